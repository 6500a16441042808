"""Effects that the nominal model leaves out, one module per family; listed in `library`."""
