// A volume with its transfer function and time step; an epoch may change both.
#pragma once

#include "tools/telesplat/scene/epochs.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

class VolumeScene : public Scene {
 public:
  using Scene::Scene;
  scene::Kind kind() const override { return scene::Kind::kVolume; }
  Status check() const override;
  /// Reads epochs.csv (epoch, ..., volume.step, "transfer") if there is one.
  Status read_record(const std::string& run_directory) override;
  Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const override;
  std::string summary(uint64_t primitives) const override;
  Result<data::Description> describe_data(const data::Progress& progress) const override;

  struct Epoch {
    std::string transfer;  ///< text form, absolute values; empty: the data server's first one
    int step = 0;
  };
  /// Returns the content of an epoch; a run without epochs.csv has one. Error: epochs.csv has no such epoch.
  Result<Epoch> at(EpochId epoch) const { return epochs_.at(epoch, {}); }

 private:
  Epochs<Epoch> epochs_;
};

}  // namespace telesplat::launcher
