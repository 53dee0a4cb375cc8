// A session as its master tells it, read without fear: what is missing or strange has a fallback.
#pragma once

#include <string>

#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::scene {

/// The value of `key`, or `fallback`.
template <class V>
V value_or(const std::map<std::string, V>& map, const std::string& key, V fallback) {
  const auto found = map.find(key);
  return found == map.end() ? fallback : found->second;
}

/// Setting: JPEG quality of the pictures that views come as, 1 to 100; 0, or not there: they come as the kind has it.
inline constexpr const char* kPictureQuality = "picture.quality";

/// Looks into a welcome; holds a reference to it.
class SessionView {
 public:
  explicit SessionView(const wire::Welcome& session) : session_(session) {}

  /// What the data are; none while no data server has said hello, or if it is of a kind that this program does not
  /// know.
  std::optional<Kind> kind() const { return kind_named(fact("kind")); }
  std::optional<Pipeline> pipeline() const {
    const auto k = kind();
    if (!k) return std::nullopt;
    const Pipeline usual = pipeline_of(*k);
    return usual == Pipeline::kPoints && setting(kPictureQuality, 0) > 0 ? Pipeline::kPictures : usual;
  }
  std::string fact(const std::string& name) const { return value_or(session_.facts, name, std::string()); }
  /// Empty if nobody serves it.
  std::string endpoint(const std::string& name) const { return value_or(session_.endpoints, name, std::string()); }
  double setting(const std::string& name, double fallback) const { return value_or(session_.settings, name, fallback); }
  double parameter(const std::string& name, double fallback) const {
    return value_or(session_.parameters, name, fallback);
  }

 private:
  const wire::Welcome& session_;
};

}  // namespace telesplat::scene
