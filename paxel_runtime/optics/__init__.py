"""The physics of the virtual bench, pure functions: projector light, print and paper, camera, spectroradiometer.

Shares nothing with the estimators but plain colorimetry and the pattern. `spectra` says how light passes ink and
paper; the other modules compute the spatial part, each one thing: `geometry` (who sees what where), `grid` (the fine
raster of the wall), `light` (projector pixels on it), `ink`, `overprint`, `fluorescence` and `paper` (the surface),
`held` (a sheet held in front), `camera`, `meter`, `cache` (set-up kept on disk).
"""
