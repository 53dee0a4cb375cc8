// Records an application: its calls, its mistakes, its frames with their times, pictures of both eyes.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::xr_test {

class Recorder {
 public:
  /// directory: made if missing; empty: nothing is written.
  explicit Recorder(const std::string& directory);
  ~Recorder();
  /// Writes calls.json, and waits until all pictures are written.
  void flush();

  void count(const char* call) { ++calls_[call]; }
  void mistake(const std::string& text);

  struct Frame {
    uint64_t number = 0;
    double display_s = 0, submitted_s = 0, shown_s = 0;  ///< monotonic clock
    bool layers = false, depth = false, discarded = false;
    geometry::Pose left;  ///< the eye's, as submitted
  };
  /// A row of frames.csv.
  void frame(const Frame& frame, double period_s);
  /// Queues a picture for the writing thread. If more than kMostWaiting wait, it is dropped and counted.
  void picture(const std::string& name, image::View view, bool exr);

  static constexpr size_t kMostWaiting = 16;

 private:
  struct Picture {
    std::string name;
    image::View view;
    bool exr;
  };
  void write_loop();

  std::string directory_;
  std::map<std::string, uint64_t> calls_;
  std::vector<std::string> mistakes_;
  std::ofstream frames_;
  uint64_t shown_ = 0, late_ = 0, missed_ = 0, dropped_ = 0;
  double first_s_ = 0, last_shown_s_ = 0;
  std::mutex mutex_;  // guards all below
  std::condition_variable changed_;
  std::deque<Picture> waiting_;
  bool stop_ = false, writing_ = false;
  std::thread thread_;
};

}  // namespace telesplat::xr_test
