// Small helpers for the text headers of volume files.
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

/// Numbers between blanks (and commas, parentheses if `loose`); none if anything else is among them.
std::optional<std::vector<double>> numbers(std::string_view text, bool loose = false);
/// All of the text as one number.
std::optional<double> number(std::string_view text);
/// Sizes: whole numbers from 0 to 2^53.
std::optional<std::vector<int64_t>> whole_numbers(std::string_view text);
/// A path beside another one's file.
std::string beside(const std::string& path, std::string_view name);
inline constexpr size_t kMostFiles = 100'000;  ///< that hold one volume
/// What a header says, by key.
using Fields = std::map<std::string, std::string_view>;
/// The value of the first of these keys that is there; else empty.
std::string_view field(const Fields& fields, std::initializer_list<const char*> names);
/// Makes the files that a header names the files of its volume: those listed, where `data` is "LIST", or those of a
/// pattern ("slice%03d.raw 1 16 1": a number from 1 to 16 in steps of 1). False: it is neither. Refuses what is no
/// pattern, no file, and more than kMostFiles or than voxels.
bool take_files(std::string_view data, std::vector<std::string> listed, const std::string& path, VolumeFileHeader& h);
/// What a file may say, cut and without control characters: for error texts.
std::string in_quotes(std::string_view text);
/// Three numbers above 0, as in "0.5,0.5,2".
std::optional<glm::dvec3> spacing_of(std::string_view text);
/// The matrix of three axis steps and an origin.
glm::dmat4 placement(const glm::dvec3& i, const glm::dvec3& j, const glm::dvec3& k, const glm::dvec3& origin);
/// The same of axes as the data's.
glm::dmat4 placement(const glm::dvec3& spacing);

}  // namespace telesplat::data
