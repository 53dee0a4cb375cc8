// Measures the GPU's time for each stage of a frame.
#pragma once

#include <cstdint>
#include <vector>

namespace telesplat::gl {

/// Time stamps between a frame's stages, written by the GPU when it reaches them.
class StageTimer {
 public:
  explicit StageTimer(int stages);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  /// False if the context has no time stamps (GL_QUERY_COUNTER_BITS is 0): then all results are 0.
  bool available() const { return !queries_.empty(); }
  void begin_frame();
  /// Stages run in order, from begin_frame() on; stages between the last that ended and this one took no time.
  void end_stage(int stage);
  /// Waits for the frame just drawn; returns the milliseconds of each stage.
  const std::vector<double>& results();

 private:
  std::vector<uint32_t> queries_;  // begin_frame, then one for each stage
  std::vector<bool> written_;
  std::vector<double> ms_;
};

}  // namespace telesplat::gl
