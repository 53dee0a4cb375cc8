// A Julia set: has parameters instead of a data file, and new ones in each epoch.
#pragma once

#include "tools/telesplat/scene/epochs.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

class JuliaScene : public Scene {
 public:
  using Scene::Scene;
  scene::Kind kind() const override { return scene::Kind::kJulia; }
  std::string name() const override;
  Status check() const override;
  /// [scene], [julia] with the parameters it begins with, [placement].
  /// Reads the data server's facts about it, and epochs.csv (epoch, t_s, a column for each parameter) if there is one.
  Status read_record(const std::string& run_directory) override;
  Status move_to(const std::string& file) override;
  Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const override;
  std::string summary(uint64_t primitives) const override;
  std::string describe_record() const override;
  Result<data::Description> describe_data(const data::Progress& progress) const override;

  struct Record {
    std::string title;
    julia::Parameters begin;
    julia::Placement placement;
    Epochs<julia::Parameters> epochs;  ///< empty if the run has no epochs.csv: it showed one set only
    /// Error: epochs.csv has no such epoch.
    Result<julia::Parameters> at(EpochId epoch) const { return epochs.at(epoch, begin); }
  };

 private:
  /// Returns the recorded set; before a run the one of the flags.
  Result<Record> record() const;
  std::optional<Record> record_;
};

}  // namespace telesplat::launcher
