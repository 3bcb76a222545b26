"""The commands of `paxel`, a file a subject: parsing and messages only; heavy imports inside the functions."""
