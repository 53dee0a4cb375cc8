// A kind of scene as the launcher knows it: what session.toml keeps of it, how its pictures are drawn directly, what is
// told of it. The one place of the launcher where kinds differ: one class and one row (scene.cpp) a kind.
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

/// A scene as rays see it, without points: what displayed frames are compared with.
class DirectScene {
 public:
  virtual ~DirectScene() = default;

  /// The scene of `epoch`: every pixel of `camera` traced and shaded with unquantised normals. Depth in metres,
  /// +infinity where nothing is. Error: the scene of that epoch is not known.
  /// footprint_px: pixels of `camera` that are one of the view it is drawn for: what a pixel shows may depend on how
  /// large it is (sampler::JuliaSampler).
  virtual Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                                   EpochId epoch, double footprint_px) = 0;
  /// The same with `samples` rays a pixel (image::validate_samples), or one of what has no surface. It is marked
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

  /// Whether pictures have the depth of a surface.
  virtual bool has_surface() const { return true; }
  /// Gives a picture, drawn directly or displayed, the depth by which measures find what shows the data set: surfaces
  /// have it.
  virtual void mark_shown(image::View& view) const { (void)view; }

  virtual uint64_t primitives() const { return 0; }  ///< triangles; 0: it has none
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
  /// Whether it is there and can be shown, as far as that is known without reading all of it. The error names file or
  /// parameter.
  virtual Status check() const;

  /// From here on of a recorded run. Takes in what else the run folder tells: the scene of each epoch. Errors name
  /// file, line, value, limit.
  virtual Status read_record(const std::string& run_directory);
  /// The data lie elsewhere now. Error: it has no data file.
  virtual Status move_to(const std::string& file);

  /// Keeps its chunk store where `options` say, if they say anything of it.
  void use_cache_of(const data::DataOptions& options);

  /// Opens the data to draw them directly. threads: to draw with, 0: all cores. Errors name the file.
  virtual Result<std::unique_ptr<DirectScene>> open_direct(int threads, const data::Progress& progress) const = 0;

  /// What a report adds to its name, with what stands between them: ": 20000 triangles". primitives: from summary.json.
  virtual std::string summary(uint64_t primitives) const = 0;
  /// What `telesplat inspect` tells of the scene of a run folder beside its summary: lines; may be empty.
  virtual std::string describe_record() const { return {}; }
  /// What `telesplat inspect` tells of the data.
  virtual Result<data::Description> describe_data(const data::Progress& progress) const = 0;

 protected:
  data::DataOptions options_;
};

/// The scene that options name. Error: as data::kind_of(), which decides what it is.
Result<std::unique_ptr<Scene>> scene_of(const data::DataOptions& options);

/// The scene that a run showed, from its session.toml and epochs.csv. Its data need not be there: check() tells. A
/// folder that names no data file has a scene without one. Errors name file, line, value and limit.
Result<std::unique_ptr<Scene>> recorded_scene(const std::string& run_directory);

/// Keys of a scene file that only one kind of scene has, and that are no flags as they stand.
class SceneKeys;

/// What the launcher has of each kind.
struct SceneKind {
  scene::Kind kind;
  std::unique_ptr<Scene> (*make)(data::DataOptions options);
  std::unique_ptr<SceneKeys> (*make_keys)();  ///< nullptr: it has none
};
const std::vector<SceneKind>& scene_kinds();

}  // namespace telesplat::launcher
