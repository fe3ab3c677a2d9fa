"""Fuzzing for hours: `tests/hostile/test_fuzz.py` with another seed in each round, until one fails or time is over.

python -m tests.fuzz [HOURS]; a failure prints its seed, which `FUZZ_SEED=n pytest tests/hostile/test_fuzz.py` repeats.
"""

import os
import subprocess
import sys
import time


def main(hours: float, cases: str = "") -> int:
    """Run rounds of all cases, or of those that pytest's `-k` chooses by `cases`; 1 after a failure."""
    end_s, seed = time.monotonic() + 3600.0 * hours, int(time.time())
    rounds = 0
    while rounds == 0 or time.monotonic() < end_s:
        command = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:cacheprovider", "tests/hostile/test_fuzz.py"]
        command += ["-k", cases] if cases else []
        done = subprocess.run(command, env=os.environ | {"FUZZ_SEED": str(seed)}, check=False)
        if done.returncode:
            print(f"FAILED with FUZZ_SEED={seed} after {rounds} rounds")
            return 1
        rounds, seed = rounds + 1, seed + 1
        print(f"{rounds} rounds, {max(0.0, end_s - time.monotonic()) / 3600.0:.2f} h to go", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.0))
