// The kind of a session's data, and the pipeline that draws it: every process asks for both. One row a kind (kind.cpp).
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string_view>

namespace telesplat::scene {

/// Kind of the data.
enum class Kind { kMesh, kJulia, kVolume };
inline constexpr Kind kKinds[] = {Kind::kMesh, Kind::kJulia, Kind::kVolume};

/// Form in which data are sent and drawn: depth images that become points; slice images; or pictures that the servers
/// draw. No kind uses pictures by itself: SessionView::pipeline().
enum class Pipeline { kPoints, kSlices, kPictures };

/// A set of kinds.
class Kinds {
 public:
  constexpr Kinds(std::initializer_list<Kind> kinds) {
    for (const Kind k : kinds) bits_ |= bit(k);
  }
  static constexpr Kinds all() {
    Kinds out{};
    for (const Kind k : kKinds) out.bits_ |= bit(k);
    return out;
  }
  static Kinds of(Pipeline pipeline);
  constexpr bool has(Kind kind) const { return (bits_ & bit(kind)) != 0; }
  constexpr bool operator==(const Kinds&) const = default;

 private:
  static constexpr unsigned bit(Kind kind) { return 1u << static_cast<unsigned>(kind); }
  unsigned bits_ = 0;
};

/// "mesh", "julia", "volume": the fact "kind" of a data server's hello, and `kind` of a scene file.
std::string_view name_of(Kind kind);
std::optional<Kind> kind_named(std::string_view name);
/// With its article, for messages: "a mesh".
std::string_view described(Kind kind);

Pipeline pipeline_of(Kind kind);

/// Defaults of a session with a kind of scene. The master sends them to all processes, so that sessions in containers
/// and those of `telesplat run` agree.
struct Policy {
  bool progressive;       ///< a view arrives with every 4th pixel of every 4th row first
  double least_sampling;  ///< sampled pixels a displayed pixel, on each axis, at least
};
const Policy& policy_of(Kind kind);

}  // namespace telesplat::scene
