// How long the GPU takes for each stage of a frame.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace telesplat::gl {

/// Time stamps between a frame's stages, written by the GPU as it gets there, so that nothing waits for them. Results
/// are read when there: some frames later, or at once where the caller has waited for the frame anyway.
class StageTimer {
 public:
  explicit StageTimer(int stages);
  ~StageTimer();
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

  /// False where the context has no time stamps (GL_QUERY_COUNTER_BITS is 0): then all results are 0.
  bool available() const { return available_; }
  void begin_frame();
  /// Stages run in order, from begin_frame() on; stages between this one and the last that ended took no time.
  void end_stage(int stage);
  /// Milliseconds of each stage: of the frame just drawn, for which this waits, or of the newest one whose results are
  /// there.
  const std::vector<double>& results(bool wait);

 private:
  static constexpr int kFrames = 4;
  struct Frame {
    std::vector<uint32_t> queries;  // begin_frame, then one a stage
    std::vector<bool> written;
    bool pending = false;
  };
  void collect(Frame& frame, bool wait);

  bool available_ = false;
  std::array<Frame, kFrames> frames_;
  int frame_ = 0;
  std::vector<double> ms_;
};

}  // namespace telesplat::gl
