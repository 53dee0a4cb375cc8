// A volume, its transfer function and the time step it stands at; an epoch has others of both.
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
    std::string transfer;  ///< text form, absolute values; empty: as the data server begins
    int step = 0;
  };
  /// What a run's epoch showed; a run without epochs.csv showed one. Error: epochs.csv has no such epoch.
  Result<Epoch> at(EpochId epoch) const { return epochs_.at(epoch, {}); }

 private:
  Epochs<Epoch> epochs_;
};

}  // namespace telesplat::launcher
