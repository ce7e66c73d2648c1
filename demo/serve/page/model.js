// What the page loads from its server, models among it.

// Asks the server for something that it must have.
export async function load(path) {
  const response = await fetch(path);
  if (!response.ok) throw new Error(`the server did not give ${path}: load the page anew`);
  return response;
}

// A model as the server packed it: skins, the bones of the pose that they are made in, its picture.
export async function readModel(bytes) {
  const length = new DataView(bytes).getUint32(0, true), start = 4 + length;
  const model = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  for (const part of Object.values(model))
    for (const name in part) {
      const [offset, size] = part[name], kind = { triangles: Uint32Array, png: Uint8Array }[name] ?? Float32Array;
      part[name] = new kind(bytes, start + offset, size);
    }
  const options = { premultiplyAlpha: "none", colorSpaceConversion: "none" };
  model.image = model.picture ? await createImageBitmap(new Blob([model.picture.png], { type: "image/png" }), options) : null;
  return model;
}
