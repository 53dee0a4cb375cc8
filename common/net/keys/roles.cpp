#include "common/net/keys/roles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <iterator>

namespace telesplat::net {
namespace {

// A set of roles.
class Roles {
 public:
  constexpr Roles(std::initializer_list<Role> roles) {
    for (const Role role : roles) bits_ |= bit(role);
  }
  constexpr bool have(Role role) const { return (bits_ & bit(role)) != 0; }

 private:
  static constexpr unsigned bit(Role role) { return 1u << unsigned(role); }
  unsigned bits_ = 0;
};

using enum Role;
constexpr Roles kEveryone{kServer, kData, kPacker, kSampler, kViewer, kOperator};
constexpr Roles kMembers{kData, kPacker, kSampler, kViewer, kOperator};
constexpr Roles kWatchers{kViewer, kOperator};  // an operator may watch, too

struct Row {
  std::string_view socket, type;
  Roles roles;
};

// Messages *to* a socket that binds. Answers need no row: the asker knows the server by its key.
constexpr Row kTable[] = {
    {"control", "hello", kMembers},
    {"control", "status", kMembers},
    {"control", "metric_rows", kMembers},
    {"control", "goodbye", kMembers},
    {"control", "clock_request", kMembers},
    {"control", "control", kEveryone},  // see kCommands
    {"control", "order_answer", {kData, kViewer, kOperator}},
    {"control", "view_request", kWatchers},
    {"control", "swap_ready", kWatchers},
    {"control", "lease_request", {kSampler}},
    {"control", "lease_extend", {kSampler}},
    {"control", "slab_ready", {kSampler}},
    {"control", "tile_done", {kPacker}},
    {"control", "tile_refused", {kPacker}},
    {"control", "plan", {kPacker}},
    {"control", "link_report", {kPacker}},
    {"control", "slice_weights", {kData}},
    {"chunks", "chunk_list_request", {kSampler, kPacker}},
    {"chunks", "chunk_request", {kSampler, kPacker}},
    {"voxels", "voxel_request", {kSampler}},
    {"tiles", "depth_tile", {kSampler}},
    {"tiles", "slice_images", {kSampler}},
    {"tiles", "picture_tile", {kSampler}},
    {"patches", "", kWatchers},  // empty type: they subscribe
    {"state", "state_request", kWatchers},
    {"state", "access_report", kWatchers},
    {"state", "base_request", kWatchers},
    {"state", "receipt", kWatchers},
    {"state", "slice_ack", kWatchers},
};

struct Command {
  std::string_view name;
  Roles roles;
};

// Commands that change nothing. All others need an operator's key.
constexpr Command kCommands[] = {
    {"status", kEveryone}, {"health", kEveryone}, {"pick", kWatchers}, {"where", kWatchers}, {"probe", kWatchers},
};

struct Name {
  Role role;
  std::string_view name, with_article;
};

constexpr Name kNames[] = {{kServer, "server", "the server"}, {kData, "data", "a data server"},
                           {kPacker, "packer", "a packer"},   {kSampler, "sampler", "a sampler"},
                           {kViewer, "viewer", "a viewer"},   {kOperator, "operator", "an operator"}};

const Name& row_of(Role role) { return *std::ranges::find(kNames, role, &Name::role); }

}  // namespace

std::string_view name_of(Role role) { return row_of(role).name; }

std::optional<Role> role_named(std::string_view name) {
  const auto found = std::ranges::find(kNames, name, &Name::name);
  return found == std::end(kNames) ? std::nullopt : std::optional(found->role);
}

std::string described(Role role) { return std::string(row_of(role).with_article); }

bool may_connect(Role role, std::string_view socket) {
  return std::ranges::any_of(kTable, [&](const Row& r) { return r.socket == socket && r.roles.have(role); });
}

bool may_send(Role role, std::string_view socket, std::string_view type) {
  return std::ranges::any_of(kTable,
                             [&](const Row& r) { return r.socket == socket && r.type == type && r.roles.have(role); });
}

bool may_be(Role role, std::string_view hello_role) {
  if (role == kServer) return false;
  if (role == kOperator) return hello_role == "viewer" || hello_role == "ctl";
  return hello_role == name_of(role);
}

bool may_command(Role role, std::string_view command) {
  const auto found = std::ranges::find(kCommands, command, &Command::name);
  return role == kOperator || (found != std::end(kCommands) && found->roles.have(role));
}

std::string as_word(std::string_view text) {
  constexpr size_t kMost = 64;
  std::string out(text.substr(0, kMost));
  for (char& c : out)
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '_' && c != '-') c = '?';
  return out;
}

std::string refused_command(Role role, std::string_view user, std::string_view command) {
  const bool tells = std::ranges::find(kCommands, command, &Command::name) != std::end(kCommands);
  return fmt::format(
      "refused: {} {}, and the key {} is {}'s", as_word(command),
      tells ? "is for viewers and operators" : "changes the session for everyone, which needs an operator's key", user,
      described(role));
}

}  // namespace telesplat::net
