"""Describe the IPOPT inside the casadi wheel to pkg-config, and print the folder to search.

Run with the Python of the environment: the description is written into that environment.
"""

import importlib.util
import re
import sys
from pathlib import Path


def ipopt_version(header: Path) -> str:
    """Version in IPOPT's configuration header, e.g. ``3.14.19``."""
    match = re.search(r'#define IPOPT_VERSION "([\d.]+)"', header.read_text(encoding="utf-8"))
    if match is None:
        raise SystemExit(f"{header} states no IPOPT_VERSION; is casadi the version of the lock?")
    return match.group(1)


def main() -> None:
    """Write ``lib/pkgconfig/ipopt.pc`` of the environment."""
    spec = importlib.util.find_spec("casadi")
    if spec is None or spec.origin is None:
        raise SystemExit("casadi is not installed; install it from environment.lock first.")
    casadi = Path(spec.origin).parent
    headers = casadi / "include" / "coin-or"
    folder = Path(sys.prefix) / "lib" / "pkgconfig"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "ipopt.pc").write_text(
        "Name: ipopt\n"
        "Description: IPOPT of the casadi wheel\n"
        f"Version: {ipopt_version(headers / 'IpoptConfig.h')}\n"
        f"Cflags: -I{headers}\n"
        f"Libs: -L{casadi} -lipopt\n",
        encoding="utf-8",
    )
    print(folder)


if __name__ == "__main__":
    main()
