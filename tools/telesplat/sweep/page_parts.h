// What the report of a sweep looks like, and how it answers a pointer.
#pragma once

namespace telesplat::launcher {

/// CSS: light, dark and paper.
const char* page_style();
/// JavaScript: what is pointed at, or has the keyboard's focus, tells its values.
const char* page_script();

}  // namespace telesplat::launcher
