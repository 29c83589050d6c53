"""Proves every property of the exported core, and that no proof holds for its mutants: `make formal`."""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from formal.cases import PROOFS
from formal.prove import prepare, solve

def main() -> int:
    folder = Path("build/formal/run")
    prepare(folder)
    pick = sys.argv[1:]
    jobs = [(f"proof{n}", p) for n, p in enumerate(PROOFS) if not pick or any(x in p.name for x in pick)]
    with ThreadPoolExecutor(2) as pool:
        for job, r in zip(jobs, pool.map(lambda j: solve(j[1], j[1].exported(), folder, j[0]), jobs)):
            print(job[0], job[1].name, r, flush=True)
    return 0
sys.exit(main())
