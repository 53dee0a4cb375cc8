// The keys and mouse buttons that mean something in a window, what they are called, and the list of what they do.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace telesplat::viewer {

/// Keys that mean something here. They are places on the keyboard, named by what is printed there on a US one: W A S D
/// lie under one hand on every keyboard.
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

/// What a key is called: what is printed on it where the person sits.
using KeyNames = std::function<std::string(Key)>;
/// As it is printed on a US keyboard.
std::string us_name(Key key);
/// The key that has this letter there, A to Z; nothing: it means nothing here.
std::optional<Key> letter_key(char letter);

/// Keys and mouse, a line each: for F1, for --help and for documentation.
std::vector<std::string> key_help(const KeyNames& name = us_name);
/// The ones to begin with, in one line.
std::string first_keys();

}  // namespace telesplat::viewer
