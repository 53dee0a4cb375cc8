// The keys and mouse buttons that a window uses, their names, and the list of what they do.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace telesplat::viewer {

/// Keys that a window uses. They are places on the keyboard, named by their print on a US keyboard: W A S D lie under
/// one hand on every keyboard.
enum class Key {
  kA,
  kB,
  kC,
  kD,
  kE,
  kF,
  kH,
  kI,
  kN,
  kO,
  kP,
  kQ,
  kR,
  kS,
  kT,
  kW,
  kX,
  k1,
  k2,
  k3,
  k4,
  k5,
  k6,
  k7,
  k8,
  kF1,
  kF11,
  kF12,
  kTab,
  kEscape,
  kShift
};
inline constexpr size_t kKeys = size_t(Key::kShift) + 1;
enum class MouseButton { kLeft, kMiddle, kRight };

/// A side of the data, as their own axes name it: +X, -X, ...
struct Side {
  int axis = 0;
  bool negative = false;
  bool operator==(const Side&) const = default;
};
/// "+X"
std::string side_name(const Side& side);

/// Returns a key's name: its print on the person's keyboard.
using KeyNames = std::function<std::string(Key)>;
/// Returns a key's print on a US keyboard.
std::string us_name(Key key);
/// Returns the key with this letter there, A to Z; nothing: a window does not use it.
std::optional<Key> letter_key(char letter);

/// Lists keys and mouse, one line each: for F1, for --help and for documentation.
std::vector<std::string> key_help(const KeyNames& name = us_name);
/// Lists the most important keys, in one line.
std::string first_keys();

}  // namespace telesplat::viewer
