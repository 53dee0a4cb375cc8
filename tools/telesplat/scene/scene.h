// A kind of scene for the launcher: reads its part of session.toml, draws it directly, describes it. The one place of
// the launcher where kinds differ: one class and one row (scene.cpp) a kind.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "common/image/measures/reference.h"
#include "common/image/shading.h"
#include "common/scene/kind.h"
#include "services/data/base/progress.h"
#include "services/data/data_options.h"
#include "services/data/description.h"

namespace telesplat::launcher {

/// Draws a scene by rays, without points: the reference for displayed frames.
class DirectScene {
 public:
  virtual ~DirectScene() = default;

  /// Draws the scene of `epoch`: every pixel of `camera` traced and shaded with unquantised normals. Depth in metres,
  /// +infinity for background. Error: the scene of that epoch is not known. footprint_px: pixels of `camera` that make
  /// one of the final view: a pixel's content may depend on its size (sampler::JuliaSampler).
  virtual Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                   EpochId epoch, double footprint_px) = 0;
  /// Draws with `samples` rays a pixel (image::validate_samples), or one if the scene has no surface. Marks the picture
  /// (mark_shown).
  Result<image::Reference> draw_reference(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                          EpochId epoch, int samples) {
    const int rays = has_surface() ? samples : 1;
    return image::supersample(camera, rays, [&](const geometry::Camera& piece) {
      auto drawn = draw(piece, shading, epoch, std::sqrt(rays));
      if (drawn) mark_shown(*drawn);
      return drawn;
    });
  }

  /// True if pictures have the depth of a surface.
  virtual bool has_surface() const { return true; }
  /// Gives a picture, drawn directly or displayed, a depth that marks the pixels of the data set for measures. Surfaces
  /// have it already.
  virtual void mark_shown(image::View& view) const { (void)view; }

  virtual uint64_t primitives() const { return 0; }  ///< triangles; 0: no triangles
  virtual std::string size() const = 0;              ///< "20000 triangles", for captions
};

class Scene {
 public:
  explicit Scene(data::DataOptions options) : options_(std::move(options)) {}
  virtual ~Scene() = default;

  virtual scene::Kind kind() const = 0;
  scene::Pipeline pipeline() const { return scene::pipeline_of(kind()); }
  const data::DataOptions& options() const { return options_; }

  /// For captions: the file's name; a Julia set's title.
  virtual std::string name() const;
  /// Checks that it exists and can be shown, as far as that is possible without reading all of it. The error names file
  /// or parameter.
  virtual Status check() const;

  /// For recorded runs. Reads the scene of each epoch from the run folder. Errors name file, line, value, limit.
  virtual Status read_record(const std::string& run_directory);
  /// Sets the present path of its data file. Error: it has no data file.
  virtual Status move_to(const std::string& file);

  /// Takes the folder of the chunk store from `options`, if they name one.
  void use_cache_of(const data::DataOptions& options);

  /// Opens the data for direct drawing. threads: for drawing, 0: all cores. Errors name the file.
  virtual Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const = 0;

  /// Returns a report's addition to its name, with the separator: ": 20000 triangles". primitives: from summary.json.
  virtual std::string summary(uint64_t primitives) const = 0;
  /// Returns lines of `telesplat inspect` about the scene of a run folder, beside its summary; may be empty.
  virtual std::string describe_record() const { return {}; }
  /// Describes the data for `telesplat inspect`.
  virtual Result<data::Description> describe_data(const data::Progress& progress) const = 0;

 protected:
  data::DataOptions options_;
};

/// Returns the scene that options name. Error: that of data::kind_of(), which decides its kind.
Result<std::unique_ptr<Scene>> scene_of(const data::DataOptions& options);

/// Returns the scene that a run showed, from its session.toml and epochs.csv. Its data may be missing: check() finds
/// out. A folder that names no data file has a scene without one. Errors name file, line, value and limit.
Result<std::unique_ptr<Scene>> recorded_scene(const std::string& run_directory);

/// Keys of a scene file that only one kind of scene has, and that do not equal flags.
class SceneKeys;

/// The launcher's parts of each kind.
struct SceneKind {
  scene::Kind kind;
  std::unique_ptr<Scene> (*make)(data::DataOptions options);
  std::unique_ptr<SceneKeys> (*make_keys)();  ///< nullptr: no keys of its own
};
const std::vector<SceneKind>& scene_kinds();

}  // namespace telesplat::launcher
