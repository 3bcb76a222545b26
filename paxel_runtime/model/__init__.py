"""What things are: frozen data and closed formulas; no files, no devices."""
