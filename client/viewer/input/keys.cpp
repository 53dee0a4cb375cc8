#include "client/viewer/input/keys.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace telesplat::viewer {
namespace {

constexpr char kLetters[] = "ABCDEFHINOPQRSTWX";  // in the order of Key
static_assert(sizeof kLetters - 1 == size_t(Key::k1));

// "[" and "]" enclose the letter of a key, or a function key's number.
struct HelpLine {
  const char *keys, *what;
};
constexpr HelpLine kHelp[] = {
    {"left drag", "orbit around the data set"},
    {"middle, [^]+left", "pan"},
    {"wheel", "nearer, farther (in flight: faster, slower)"},
    {"right drag", "nearer (up), farther (down)"},
    {"[^]+right", "tilt to the side"},
    {"double click", "what lies there comes to the middle and is what the camera turns about"},
    {"Tab", "show, hide the panel"},
    {"[F]", "fly: [W] [A] [S] [D], [E] up, [Q] down, the mouse looks around, [^] is faster"},
    {"[R]", "back to the first view"},
    {"[^]+X Y Z", "from the side of +X, +Y, +Z of the data; again: from that of -X, -Y, -Z"},
    {"Ctrl+Z", "undo what changed the picture; Ctrl+[^]+Z, Ctrl+Y: do it again"},
    {"[T]", "play the recorded head movement (--trajectory, or [C]), or take the camera"},
    {"[C]", "begin, end recording the camera's path; it is written as path-DATE.csv"},
    {"[1] [2] [3] [4]", "splats: square, disc, ellipse, ewa (not of volumes)"},
    {"[5] [6] [7]", "finish: fill pin-holes, smooth, antialias (not of volumes)"},
    {"[8]", "shading on, off (not of volumes)"},
    {"[X]", "measure the place under the cursor: value, distance from the one before, angle"},
    {"[B], [N]", "keep a bookmark of this view beside the data set; go to the next bookmark"},
    {"[I]", "show, hide axes, scale, cursor and frame rate"},
    {"[P], F12", "screenshot, into images/ of the run folder or the current folder"},
    {"[O]", "open another data set, where the session is this window's own"},
    {"F11", "full screen, or a window again"},
    {"F1, [H]", "show, hide these keys"},
    {"Esc", "close the dialog or these keys, leave flight"},
    {"Ctrl+Q", "quit at once"},
    {"[Q] twice", "quit (not in flight)"},
};

Key key_of(char mark) {
  if (mark == '^') return Key::kShift;
  if (mark >= '1' && mark <= '8') return Key(int(Key::k1) + mark - '1');
  return *letter_key(mark);
}

std::string named(std::string_view text, const KeyNames& name) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '[' && i + 2 < text.size() && text[i + 2] == ']') {
      out += name(key_of(text[i + 1]));
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

}  // namespace

std::string side_name(const Side& side) { return {side.negative ? '-' : '+', char('X' + side.axis)}; }

std::string us_name(Key key) {
  static constexpr std::pair<Key, const char*> kNames[] = {{Key::kF1, "F1"},      {Key::kF11, "F11"},
                                                           {Key::kF12, "F12"},    {Key::kTab, "Tab"},
                                                           {Key::kEscape, "Esc"}, {Key::kShift, "shift"}};
  for (const auto& [named, name] : kNames)
    if (named == key) return name;
  if (key >= Key::k1 && key <= Key::k8) return std::string(1, char('1' + int(key) - int(Key::k1)));
  return std::string(1, kLetters[size_t(key)]);
}

std::optional<Key> letter_key(char letter) {
  const size_t at = std::string_view(kLetters).find(letter);
  return at == std::string_view::npos ? std::nullopt : std::optional(Key(at));
}

std::vector<std::string> key_help(const KeyNames& name) {
  constexpr size_t kWhat = 21;  // column of the second part
  std::vector<std::string> out;
  for (const auto& [keys, what] : kHelp) {
    std::string line = named(keys, name);
    line.resize(std::max(line.size() + 1, kWhat), ' ');
    out.push_back(line + named(what, name));
  }
  return out;
}

std::string first_keys() {
  return "F1 shows all keys: Tab shows the panel, left drag orbits, the wheel goes nearer, F flies, R goes back, P "
         "takes a screenshot, Ctrl+Q "
         "quits";
}

}  // namespace telesplat::viewer
