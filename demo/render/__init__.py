"""The scene on the screen: window, camera, OpenGL passes."""
