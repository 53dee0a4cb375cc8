// `telesplat-lab simulate`.
#pragma once

#include "tools/telesplat/command.h"

namespace telesplat::simulation {

launcher::Command simulate_command();

/// glibc chooses variants of sin, exp and others by the processor, and they give other bits. Starts this program anew
/// with the variable that gives all processors the plain ones, unless it has it. Precondition: no thread was started.
void choose_plain_functions();

}  // namespace telesplat::simulation
