// telesplat-bench: codec, sampler, packer and splatter figures beside their baselines. `--benchmark_filter=` chooses.
#include <benchmark/benchmark.h>

BENCHMARK_MAIN();
