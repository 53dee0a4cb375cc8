// The terminal as a screen of styled lines. Only screen.cpp sees the library that draws them.
#pragma once

#include <memory>

#include "tools/telesplat/top/layout.h"

namespace telesplat::launcher {

class TopScreen {
 public:
  /// Takes the terminal over. Null: it cannot be one (no terminal, or of a type that nobody knows).
  static std::unique_ptr<TopScreen> open();
  /// Gives it back as it was.
  ~TopScreen();
  TopScreen(const TopScreen&) = delete;
  TopScreen& operator=(const TopScreen&) = delete;

  int width() const;
  /// The lines that fit, and `foot` in the last line.
  void draw(const std::vector<TopLine>& lines, const std::string& foot);
  /// The key that was pressed, waited for at most timeout_ms; kResized: the terminal has another size; 0: none.
  int key(int timeout_ms);
  static constexpr int kResized = -1;

 private:
  TopScreen() = default;
};

}  // namespace telesplat::launcher
