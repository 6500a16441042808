"""The musculoskeletal model: tables, participants, rotations, and OpenSim as source of geometry."""
