"""Small helpers over OpenGL 3.3. Imported only once a window is open: PyOpenGL picks its platform when imported."""

from typing import Any, Sequence

import numpy as np
from OpenGL import GL


def program(vertex: str, fragment: str, textures: Sequence[str] = ()) -> "Program":
    """Compiles and links; textures: the names of its samplers, by the unit that each reads (bind_textures). Raises
    RuntimeError with the driver's log."""
    handle = GL.glCreateProgram()
    for kind, source in ((GL.GL_VERTEX_SHADER, vertex), (GL.GL_FRAGMENT_SHADER, fragment)):
        shader = GL.glCreateShader(kind)
        GL.glShaderSource(shader, source)
        GL.glCompileShader(shader)
        if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
            raise RuntimeError(f"the graphics driver refused a shader: {GL.glGetShaderInfoLog(shader)}")
        GL.glAttachShader(handle, shader)
        GL.glDeleteShader(shader)
    GL.glLinkProgram(handle)
    if not GL.glGetProgramiv(handle, GL.GL_LINK_STATUS):
        raise RuntimeError(f"the graphics driver refused a program: {GL.glGetProgramInfoLog(handle)}")
    GL.glUseProgram(handle)
    for unit, name in enumerate(textures):
        GL.glUniform1i(GL.glGetUniformLocation(handle, name), unit)
    return Program(handle)


class Program:
    """A linked program; uniforms are set by name, floats and matrices by their number of values."""

    _SETTERS = {2: GL.glUniform2f, 3: GL.glUniform3f, 4: GL.glUniform4f}

    def __init__(self, handle: int) -> None:
        self.handle = handle
        self._locations: dict[str, int] = {}

    def use(self, **uniforms: Any) -> None:
        """Makes it current and sets its uniforms: numbers, vectors of 2 to 4, (4, 4) matrices for column vectors, or
        float32 arrays (n, 4) for arrays of vectors."""
        GL.glUseProgram(self.handle)
        for name, value in uniforms.items():
            if name not in self._locations:
                self._locations[name] = GL.glGetUniformLocation(self.handle, name)
            location, value = self._locations[name], np.asarray(value, np.float32)
            if value.ndim == 0:
                GL.glUniform1f(location, float(value))
            elif value.ndim == 1:
                self._SETTERS[len(value)](location, *map(float, value))
            elif value.shape == (4, 4):
                GL.glUniformMatrix4fv(location, 1, GL.GL_TRUE, value)
            else:
                GL.glUniform4fv(location, len(value), np.ascontiguousarray(value))


def buffer(data: np.ndarray, target: int = GL.GL_ARRAY_BUFFER) -> int:
    """A buffer that holds `data` for good."""
    handle = GL.glGenBuffers(1)
    GL.glBindBuffer(target, handle)
    GL.glBufferData(target, data.nbytes, data, GL.GL_STATIC_DRAW)
    return handle


class Buffer:
    """A buffer written anew each picture."""

    def __init__(self, target: int = GL.GL_ARRAY_BUFFER) -> None:
        self.handle, self._target = GL.glGenBuffers(1), target
        GL.glBindBuffer(target, self.handle)

    def write(self, values: np.ndarray) -> None:
        """Replaces the content."""
        values = np.ascontiguousarray(values)
        GL.glBindBuffer(self._target, self.handle)
        GL.glBufferData(self._target, values.nbytes, values, GL.GL_STREAM_DRAW)


class InstanceBuffer(Buffer):
    """Rows of floats, one row an instance."""

    def __init__(self, first_location: int, widths: tuple[int, ...]) -> None:
        """Feeds attributes `first_location` and on, of the given numbers of floats, to the bound vertex array."""
        super().__init__()
        interleave(first_location, widths)
        for location in range(first_location, first_location + len(widths)):
            GL.glVertexAttribDivisor(location, 1)


def interleave(first_location: int, widths: Sequence[int]) -> None:
    """Feeds the bound buffer, rows of floats, to attributes `first_location` and on of the given numbers of floats."""
    offsets = np.concatenate([[0], np.cumsum(widths)]) * 4
    for location, (width, offset) in enumerate(zip(widths, offsets), first_location):
        GL.glEnableVertexAttribArray(location)
        GL.glVertexAttribPointer(location, width, GL.GL_FLOAT, False, int(offsets[-1]), _pointer(offset))


def attribute(location: int, width: int, offset: int = 0) -> None:
    """Feeds the bound buffer, tightly packed from a byte on, to one attribute of the bound vertex array."""
    GL.glEnableVertexAttribArray(location)
    GL.glVertexAttribPointer(location, width, GL.GL_FLOAT, False, 0, _pointer(offset))


def _pointer(offset: int) -> Any:
    return GL.GLvoidp(int(offset))


def texture(width: int, height: int, pixels: bytes | None = None, single: bool = False) -> int:
    """A texture of 8-bit RGBA (or one 8-bit channel), smooth, clamped at its borders."""
    inner, outer = (GL.GL_R8, GL.GL_RED) if single else (GL.GL_RGBA8, GL.GL_RGBA)
    handle = GL.glGenTextures(1)
    GL.glBindTexture(GL.GL_TEXTURE_2D, handle)
    GL.glPixelStorei(GL.GL_UNPACK_ALIGNMENT, 1)
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, inner, width, height, 0, outer, GL.GL_UNSIGNED_BYTE, pixels)
    for name, value in (
        (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
        (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
        (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
        (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
    ):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
    return handle


def bind_textures(*handles: int) -> None:
    """What programs read from unit 0 on."""
    for unit, handle in reversed(list(enumerate(handles))):
        GL.glActiveTexture(GL.GL_TEXTURE0 + unit)
        GL.glBindTexture(GL.GL_TEXTURE_2D, handle)


class DepthMap:
    """A square picture of depths alone. What is read from it is the share of four pixels about a place that lie no
    nearer than the depth given: 1 beyond its borders."""

    def __init__(self, side: int) -> None:
        self.side = side
        self.texture = GL.glGenTextures(1)
        GL.glBindTexture(GL.GL_TEXTURE_2D, self.texture)
        kind = (GL.GL_DEPTH_COMPONENT16, side, side, 0, GL.GL_DEPTH_COMPONENT, GL.GL_UNSIGNED_SHORT, None)
        GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, *kind)
        for name, value in (
            (GL.GL_TEXTURE_MIN_FILTER, GL.GL_LINEAR),
            (GL.GL_TEXTURE_MAG_FILTER, GL.GL_LINEAR),
            (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
            (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
            (GL.GL_TEXTURE_COMPARE_MODE, GL.GL_COMPARE_REF_TO_TEXTURE),
            (GL.GL_TEXTURE_COMPARE_FUNC, GL.GL_LEQUAL),
        ):
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
        before = bound_framebuffer()
        self._handle = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self._handle)
        GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, GL.GL_DEPTH_ATTACHMENT, GL.GL_TEXTURE_2D, self.texture, 0)
        GL.glDrawBuffer(GL.GL_NONE)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, before)

    def bind(self) -> None:
        """Draws go here from now on, and nothing is nearer than anything yet."""
        bind_framebuffer(self._handle, (self.side, self.side))
        clear_depth()


class Target:
    """A picture that can be drawn into: colour (a texture, or multisampled) and, if asked, depth."""

    def __init__(self, width: int, height: int, samples: int = 0, depth: bool = True, single: bool = False) -> None:
        self.width, self.height, self.samples = width, height, samples
        self.texture: int | None = None
        self._buffers: list[int] = []
        before = bound_framebuffer()
        self.handle = GL.glGenFramebuffers(1)
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.handle)
        if samples:
            self._attach(GL.GL_COLOR_ATTACHMENT0, GL.GL_RGBA8, samples)
        else:
            self.texture = texture(width, height, single=single)
            GL.glFramebufferTexture2D(GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D, self.texture, 0)
        if depth:
            self._attach(GL.GL_DEPTH_ATTACHMENT, GL.GL_DEPTH_COMPONENT24, samples)
        if GL.glCheckFramebufferStatus(GL.GL_FRAMEBUFFER) != GL.GL_FRAMEBUFFER_COMPLETE:
            raise RuntimeError(f"the graphics driver refused a picture of {width} x {height}")
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, before)

    def _attach(self, point: int, kind: int, samples: int) -> None:
        handle = GL.glGenRenderbuffers(1)
        GL.glBindRenderbuffer(GL.GL_RENDERBUFFER, handle)
        GL.glRenderbufferStorageMultisample(GL.GL_RENDERBUFFER, samples, kind, self.width, self.height)
        GL.glFramebufferRenderbuffer(GL.GL_FRAMEBUFFER, point, GL.GL_RENDERBUFFER, handle)
        self._buffers.append(handle)

    def bind(self) -> None:
        """Draws go here from now on."""
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, self.handle)
        GL.glViewport(0, 0, self.width, self.height)

    def resolve_to(self, framebuffer: int, size: tuple[int, int]) -> None:
        """Copies the colours, samples averaged, to all of another framebuffer of (width, height) pixels and leaves that
        bound."""
        GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, self.handle)
        GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, framebuffer)
        GL.glBlitFramebuffer(
            0,
            0,
            self.width,
            self.height,
            0,
            0,
            *size,
            GL.GL_COLOR_BUFFER_BIT,
            GL.GL_NEAREST if size == (self.width, self.height) else GL.GL_LINEAR,
        )
        bind_framebuffer(framebuffer, size)

    def delete(self) -> None:
        """Frees it."""
        GL.glDeleteFramebuffers(1, [self.handle])
        if self.texture is not None:
            GL.glDeleteTextures(1, [self.texture])
        if self._buffers:
            GL.glDeleteRenderbuffers(len(self._buffers), self._buffers)


def read_pixels(width: int, height: int) -> np.ndarray:
    """(height, width, 3) uint8 of the bound framebuffer, top row first."""
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    data = GL.glReadPixels(0, 0, width, height, GL.GL_RGB, GL.GL_UNSIGNED_BYTE)
    return np.frombuffer(data, np.uint8).reshape(height, width, 3)[::-1].copy()


def is_software() -> bool:
    """True where a processor draws: there each sample of a pixel costs its full price."""
    name = GL.glGetString(GL.GL_RENDERER).decode().lower()
    return any(word in name for word in ("llvmpipe", "softpipe", "swrast", "software", "swiftshader", "gdi generic"))


def bound_framebuffer() -> int:
    """The framebuffer that draws go to."""
    return int(GL.glGetIntegerv(GL.GL_DRAW_FRAMEBUFFER_BINDING))


def bind_framebuffer(handle: int, size: tuple[int, int]) -> None:
    """Draws go to the whole of `handle` from now on."""
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, handle)
    GL.glViewport(0, 0, *size)


def inlay(picture: Target, framebuffer: int, left: int, bottom: int) -> None:
    """Copies a picture without samples to a place in another framebuffer."""
    GL.glBindFramebuffer(GL.GL_READ_FRAMEBUFFER, picture.handle)
    GL.glBindFramebuffer(GL.GL_DRAW_FRAMEBUFFER, framebuffer)
    GL.glBlitFramebuffer(
        0,
        0,
        picture.width,
        picture.height,
        left,
        bottom,
        left + picture.width,
        bottom + picture.height,
        GL.GL_COLOR_BUFFER_BIT,
        GL.GL_NEAREST,
    )
    GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, framebuffer)


def clear(colour: tuple[float, float, float]) -> None:
    """Fills what is bound with a colour."""
    GL.glClearColor(*colour, 1.0)
    GL.glClear(GL.GL_COLOR_BUFFER_BIT)


def clear_depth() -> None:
    """Empties the depth buffer of what is bound."""
    GL.glClear(GL.GL_DEPTH_BUFFER_BIT)


def version() -> tuple[int, int]:
    """OpenGL's version."""
    return int(GL.glGetIntegerv(GL.GL_MAJOR_VERSION)), int(GL.glGetIntegerv(GL.GL_MINOR_VERSION))


def renderer_name() -> str:
    """What draws, in the driver's words."""
    return GL.glGetString(GL.GL_RENDERER).decode()


def finish() -> None:
    """Waits until everything that was asked for is drawn."""
    GL.glFinish()
