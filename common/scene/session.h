// Reads a session as its master sends it: missing or invalid values have fallbacks.
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

/// Reads a welcome; holds a reference to it.
class SessionView {
 public:
  explicit SessionView(const wire::Welcome& session) : session_(session) {}

  /// Kind of the data; nothing while no data server has said hello, or if this program does not know the kind.
  std::optional<Kind> kind() const { return kind_named(fact("kind")); }
  std::optional<Pipeline> pipeline() const {
    const auto k = kind();
    if (!k) return std::nullopt;
    const Pipeline usual = pipeline_of(*k);
    return usual == Pipeline::kPoints && session_.settings.pictures ? Pipeline::kPictures : usual;
  }
  std::string fact(const std::string& name) const { return value_or(session_.facts, name, std::string()); }
  /// Empty: no process serves it.
  std::string endpoint(const std::string& name) const { return value_or(session_.endpoints, name, std::string()); }
  const wire::SessionSettings& settings() const { return session_.settings; }
  double parameter(const std::string& name, double fallback) const {
    return value_or(session_.parameters, name, fallback);
  }

 private:
  const wire::Welcome& session_;
};

}  // namespace telesplat::scene
