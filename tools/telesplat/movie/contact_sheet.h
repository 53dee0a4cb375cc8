// Small pictures of a run's frames beside each other, each with its time, its number and what its scene's parameters
// were.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/image/file.h"
#include "tools/telesplat/record/recorded_run.h"

namespace telesplat::launcher {

/// Which numbers of an epoch's row of epochs.csv differ between epochs: "c.y -0.41  slice.offset 0.2". Nothing where
/// there is one epoch only, or no such file. Values have four digits.
class EpochCaptions {
 public:
  explicit EpochCaptions(const std::string& run_directory);
  std::string of(EpochId epoch) const;

 private:
  std::vector<std::pair<uint64_t, std::string>> captions_;
};

class ContactSheet {
 public:
  explicit ContactSheet(const std::string& run_directory) : epochs_(run_directory) {}

  void add(const image::View& picture, const DisplayedFrame& frame);
  size_t pictures() const { return cells_.size(); }
  Status write(const std::string& path, const std::string& title) const;

 private:
  struct Cell {
    image::View picture;  // small
    std::string caption, parameters;
  };
  EpochCaptions epochs_;
  std::vector<Cell> cells_;
};

}  // namespace telesplat::launcher
