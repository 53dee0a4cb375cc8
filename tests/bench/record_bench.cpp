// Costs of recording a display frame: its row of frames.csv and its span, and once a second the message that takes them
// to the master.
#include <benchmark/benchmark.h>

#include "client/viewer/display/frame_table.h"
#include "common/metrics/recorder.h"
#include "common/wire/serial.h"

namespace telesplat {
namespace {

// An iteration is a frame. Argument: frames a second.
void record_frames(benchmark::State& state) {
  const auto fps = int(state.range(0));
  metrics::TableRecorder frames("frames", viewer::frame_columns());
  metrics::SpanRecorder spans;
  viewer::MeasuredFrame frame;
  int n = 0;
  size_t bytes = 0;
  for (auto _ : state) {
    frame.number = uint64_t(n);
    frames.add(viewer::frame_row(frame));
    spans.add("display frame", n, n + 0.01, 0, {.request = double(n)});
    if (++n % fps) continue;
    for (const auto& rows : {frames.flush({1}), spans.flush({1})}) bytes += wire::encode(*rows).size();
  }
  // Share of a frame's period at this rate.
  state.counters["share_of_frame"] =
      benchmark::Counter(1.0 / fps, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["bytes_a_frame"] = benchmark::Counter(double(bytes) / double(std::max(n, 1)));
}
BENCHMARK(record_frames)->Arg(60)->Arg(90);

}  // namespace
}  // namespace telesplat
