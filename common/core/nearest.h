// For "did you mean": finds the known word nearest to a misspelt one.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string_view>

namespace telesplat {

/// Letters to insert, delete, change or swap with their neighbour until one word is the other; case counts.
size_t edit_distance(std::string_view a, std::string_view b);

/// The candidate nearest to `word`, the first of equals; nothing if even that one differs in more than a third of its
/// letters (and more than one).
std::optional<std::string_view> nearest_word(std::string_view word, std::span<const std::string_view> candidates);

}  // namespace telesplat
