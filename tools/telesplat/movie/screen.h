// The screen at a moment of a recorded run: the frame of its display, or those of a wall's tiles side by side.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/viewer/display/eyes/eye_rig.h"
#include "common/image/legend.h"
#include "tools/telesplat/record/frame_replay.h"

namespace telesplat::launcher {

class Screen {
 public:
  /// Opens the run in this folder. width, height: pixels of the whole picture; 0: as displayed. Error: names the file,
  /// or `size_flag` and what is wrong with the size.
  static Result<Screen> open(const std::string& directory, int width, int height, const char* size_flag, int threads);

  /// Time from the first frame on screen (for a wall: when all tiles had one) to the last.
  double duration_s() const { return duration_s_; }
  /// Result of show(); kRecordEnds: the record ends before the frame that was on screen at t_s.
  enum class Shown { kNew, kSame, kRecordEnds };
  /// Draws into view() the screen t_s seconds after the first frame. t_s never falls.
  Result<Shown> show(double t_s);
  const image::View& view() const { return view_; }

  /// The first tile's run, and its frame on screen.
  const RecordedRun& run() const { return *tiles_.front().run; }
  const DisplayedFrame& frame() const;
  int width() const { return width_; }
  int height() const { return height_; }
  /// Number of frames drawn on the first tile.
  uint64_t drawn() const { return drawn_; }
  /// "points.events"
  std::string record_file() const;
  /// Lines for the person.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Tile {
    std::unique_ptr<RecordedRun> run;  // its address stays: replay refers to it
    std::unique_ptr<FrameReplay> replay;
    size_t frame = 0;    // index of the frame on screen
    bool drawn = false;  // view shows it
    image::View view;
    std::unique_ptr<viewer::EyeRig> rig;  // for frames of two eyes; else null
    std::array<image::View, 2> eyes;
  };
  Status choose_size(int width, int height, const char* size_flag);
  Status choose_size_of_description(int width, int height, const char* size_flag);
  Status open_replays(int threads);
  Status read_legends(const std::string& directory);
  void find_times();
  Result<bool> draw(Tile& tile);
  Result<bool> draw_pair(Tile& tile, const DisplayedFrame& frame, const geometry::Camera& camera);
  void compose();

  std::vector<Tile> tiles_;
  std::map<EpochId, std::shared_ptr<const image::Legend>> legends_;  // only epochs with a legend
  int width_ = 0, height_ = 0;                                       // size of the whole
  std::vector<geometry::Rect> places_;                               // tiles' places in the whole
  double begin_s_ = 0, duration_s_ = 0;
  uint64_t drawn_ = 0;
  image::View view_;
  std::vector<std::string> notes_;
};

}  // namespace telesplat::launcher
