// What is tuned: a scene with the flags of its runs, and which of its parameters are free.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/scene/kind.h"
#include "tools/telesplat/tune/candidates.h"

namespace telesplat::launcher {

struct TuneRequest {
  std::string scene;
  std::vector<std::string> links;  ///< --link, as `telesplat run` takes it
  std::vector<std::string> flags;  ///< of every run
  double run_s = 6;                ///< that each run lasts, where the flags do not say
  bool quick = false;
};

struct TuneSubject {
  TuneRequest request;
  scene::Kind kind = scene::Kind::kMesh;
  TuneSettings defaults;  ///< with what the flags say; `scale` is known once costs are measured
  TuneGrid grid;          ///< parameters that the flags give, or that the kind does not have, have one value
  TuneCosts base;         ///< what is known before anything is measured
  bool link_stated = false;
  double run_s = 6;       ///< that each run lasts; 0: not known
  int verify_every = 60;  ///< frames

  /// What a scene file has to say: keys of [scene], [view], [packing] and [julia], each with its value as text; a flag
  /// without value has "true". Of what was given all but what is about measuring; the choice comes besides.
  std::map<std::string, std::map<std::string, std::string>> keys;
};

/// Looks at all of it as `telesplat run` does, and starts nothing. Error: what `telesplat run` would refuse, or that
/// nothing is left to tune.
Result<TuneSubject> look_at(const TuneRequest& request);

/// Flags that make `settings` of the subject's defaults, "--samplers=2"; none for the defaults.
std::vector<std::string> tuned_flags(const TuneSubject& subject, const TuneSettings& settings);
/// The same for people: "samplers 2, tile-size 128"; "defaults".
std::string words(const TuneSubject& subject, const TuneSettings& settings);
/// The words behind `telesplat`. verified: with pictures' errors.
std::vector<std::string> run_words(const TuneSubject& subject, const TuneSettings& settings, const std::string& out,
                                   bool verified);

}  // namespace telesplat::launcher
