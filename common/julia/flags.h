// The command line of a Julia set: one flag a parameter. Shared by the programs that take one.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/julia/animation.h"
#include "common/options/table.h"

namespace telesplat::julia {

/// The word in place of a data file.
inline constexpr std::string_view kSceneWord = "julia";

/// Bytes of a scene's animation as text: it is sent in one string of a message.
inline constexpr size_t kMaxAnimation = 4000;

/// The names of parameter_infos(), each with an empty text.
std::vector<std::pair<std::string, std::string>> parameters_not_given();

/// The texts as given: not read or checked yet.
struct SceneOptions {
  std::string preset;  ///< empty: the first of presets()
  std::string c;       ///< "i,j,k,real"; empty: not given
  /// Parameter name and text, in the order of parameter_infos(); an empty text means "not given".
  std::vector<std::pair<std::string, std::string>> values = parameters_not_given();
  std::string animate;  ///< empty or "off": nothing
  bool any() const;     ///< true if a value was given that only a Julia set takes
};

/// --preset, --c, --animate and one flag a parameter: --c.x, --iterations, ..., limits in their help.
options::Table scene_table(SceneOptions& options);

struct Scene {
  std::string title;      ///< "julia (coral)"; "julia" if c was given
  Parameters parameters;  ///< with the animation's values at 0 s
  Timeline timeline;
};
/// Applies preset, then c, then single parameters, then the animation. Error: bad text, with limits; as validate().
Result<Scene> read_scene(const SceneOptions& options);

/// Flags with the same values, for another program.
std::vector<std::string> to_flags(SceneOptions options);

/// Reads a parameter's value as people write it: a number, or the name of a palette or of a colour source.
Result<double> read_value(std::string_view name, const std::string& text);

/// Names, constants and descriptions, a line each.
std::string describe_presets();

/// Places the scene in the room, with its set during the whole animation. Error: the slice is empty at some time.
Result<Placement> place(const Scene& scene, double room_size_m,
                        const std::function<void(size_t, size_t)>& progress = {});

}  // namespace telesplat::julia
