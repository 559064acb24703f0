"""What contact costs, as ratios: python -m benchmarks [--quick]."""

from sphshell_pin.benchmarks import queries, step
from sphshell_pin.benchmarks.timing import print_sections

if __name__ == "__main__":
    print_sections(queries.section, step.section)
