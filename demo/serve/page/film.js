// A video of the picture, as the browser itself encodes it.

const KINDS = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];
const BITS = 8e6; // a second

export class Film {
  // done: is given a file's name and its content.
  constructor(canvas, done) {
    Object.assign(this, { canvas, done, recorder: null });
  }

  get running() {
    return this.recorder !== null;
  }

  // Begins, or ends; says why it cannot.
  toggle() {
    if (this.running) return this.recorder.stop();
    const kind = window.MediaRecorder && KINDS.find((each) => MediaRecorder.isTypeSupported(each));
    if (!kind) throw new Error("this browser records no video");
    const stream = this.canvas.captureStream(60), blocks = [];
    this.recorder = new MediaRecorder(stream, { mimeType: kind, videoBitsPerSecond: BITS });
    this.recorder.ondataavailable = ({ data }) => blocks.push(data);
    this.recorder.onstop = () => {
      for (const track of stream.getTracks()) track.stop();
      this.recorder = null;
      this.done(`patchwalk.${kind.match(/webm|mp4/)[0]}`, new Blob(blocks, { type: kind }));
    };
    this.recorder.start();
  }
}
