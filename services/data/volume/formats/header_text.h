// Small helpers for the text headers of volume files.
#pragma once

#include <glm/mat4x4.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "services/data/volume/formats/header.h"

namespace telesplat::data {

std::string_view trim(std::string_view text);
std::string lower(std::string_view text);
/// Numbers between blanks (and commas, parentheses if `loose`); none if anything else is among them.
std::optional<std::vector<double>> numbers(std::string_view text, bool loose = false);
/// All of the text as one number.
std::optional<double> number(std::string_view text);
/// Sizes: whole numbers from 0 to 2^53.
std::optional<std::vector<int64_t>> whole_numbers(std::string_view text);
/// A path beside another one's file.
std::string beside(const std::string& path, std::string_view name);
inline constexpr size_t kMostFiles = 100'000;  ///< that hold one volume
/// Returns the names that a pattern stands for: "slice%03d.raw 1 16 1" has a number from 1 to 16 in steps of 1. Error:
/// it is no pattern, or names more than kMostFiles.
Result<std::vector<std::string>> files_of_pattern(std::string_view text);
/// Makes these the files of a volume, beside the header at `path`. Error: there are none, or more than voxels.
Status take_files(const std::vector<std::string>& names, const std::string& path, VolumeFileHeader& header);
/// What a file may say, cut and without control characters: for error texts.
std::string in_quotes(std::string_view text);
/// The matrix of three axis steps and an origin.
glm::dmat4 placement(const glm::dvec3& i, const glm::dvec3& j, const glm::dvec3& k, const glm::dvec3& origin);

}  // namespace telesplat::data
