// Helpers for the text headers of volume files.
#pragma once

#include <glm/mat4x4.hpp>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/refusal.h"
#include "services/data/base/text_scanner.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// Parses numbers between blanks (and commas, parentheses if `loose`); nullopt if other text is among them.
std::optional<std::vector<double>> numbers(std::string_view text, bool loose = false);
/// Parses the whole text as one number.
std::optional<double> number(std::string_view text);
/// Parses sizes: integers from 0 to 2^53.
std::optional<std::vector<int64_t>> whole_numbers(std::string_view text);
/// Returns the path of a file beside another one.
std::string beside(const std::string& path, std::string_view name);
inline constexpr size_t kMostFiles = 100'000;  ///< files of one volume, at most
/// The fields of a header, by key.
using Fields = std::map<std::string, std::string_view>;
/// Returns the value of the first of these keys that exists; else empty.
std::string_view field(const Fields& fields, std::initializer_list<const char*> names);
/// Takes the files of a volume from its header: those listed, if `data` is "LIST", or those of a pattern
/// ("slice%03d.raw 1 16 1": a number from 1 to 16 in steps of 1). False: it is neither. Refuses invalid patterns,
/// missing files, and more files than kMostFiles or than voxels.
bool take_files(std::string_view data, std::vector<std::string> listed, const std::string& path, VolumeFileHeader& h);
/// Quotes a file's text for error texts: shortened, and without control characters.
std::string in_quotes(std::string_view text);
/// Parses three numbers above 0, as in "0.5,0.5,2".
std::optional<glm::dvec3> spacing_of(std::string_view text);
/// Returns the matrix of three axis steps and an origin.
glm::dmat4 placement(const glm::dvec3& i, const glm::dvec3& j, const glm::dvec3& k, const glm::dvec3& origin);
/// The same for axes along the data's, with origin 0.
glm::dmat4 placement(const glm::dvec3& spacing);

}  // namespace telesplat::data
