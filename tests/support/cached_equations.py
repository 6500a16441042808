"""Equations of motion for the tests, built once and kept until their source files change."""

import hashlib
import tempfile
from pathlib import Path

from scapulohumeral import provenance
from scapulohumeral.dynamics import compiled


def cached_equations(name: str, folder: Path) -> compiled.CompiledDynamics:
    """Equations of a formulation from `folder`, built first if they are not there."""
    sources = provenance.code_of("scapulohumeral.dynamics.compiled")
    state = hashlib.sha256(b"".join(path.read_bytes() for path in sources)).hexdigest()[:16]
    target = folder / f"{name}_{state}"
    if not target.exists():
        # Tests run in parallel processes: the complete folder appears at once.
        unfinished = Path(tempfile.mkdtemp(dir=folder))
        compiled.build(name).save(unfinished)
        try:
            unfinished.replace(target)
        except OSError:  # another process was faster
            assert target.exists()
    return compiled.load(target)
