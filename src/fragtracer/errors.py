# SPDX-License-Identifier: MIT
"""The errors that a user can mend. Anything else that is raised is a bug of fragtracer."""


class FragtracerError(Exception):
    """A problem with the input or the machine; the message says what to do about it."""


class SceneError(FragtracerError):
    """A scene file that cannot be read or does not describe a scene."""


class ShaderError(FragtracerError):
    """Shader source that cannot be assembled, or that the driver rejects."""


class DeviceError(FragtracerError):
    """OpenGL is missing, too old, or refused what was asked of it."""


class OutputError(FragtracerError):
    """A result that cannot be written where it was asked for."""


class FilmError(FragtracerError):
    """A film on disk that is damaged, or is not of the picture that it is wanted for."""
