"""The design side's stages: read the folder, call the pure functions, write the stage's folder as a whole."""

__all__: list[str] = []
