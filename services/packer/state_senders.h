// Who may speak for a viewer on the `state` socket: the key that spoke for it first.
#pragma once

#include <string>
#include <unordered_map>

#include "common/core/ids.h"
#include "common/net/socket.h"

namespace telesplat::packer {

class StateSenders {
 public:
  static constexpr size_t kMost = 4096;  ///< viewers that are remembered; further ones may be anybody's

  /// Without keys, and with other keys than viewers', anybody may. viewer: as the message names it.
  bool may_speak(const net::Message& message, InstanceId viewer) {
    if (message.role != net::Role::kViewer) return true;
    const auto owner = owners_.find(viewer);
    if (owner != owners_.end()) return owner->second == message.user;
    if (owners_.size() < kMost) owners_.emplace(viewer, message.user);
    return true;
  }

 private:
  std::unordered_map<InstanceId, std::string> owners_;
};

/// Why a message is refused.
inline constexpr const char* kNotItsViewer = "it speaks for a viewer of another key";

}  // namespace telesplat::packer
