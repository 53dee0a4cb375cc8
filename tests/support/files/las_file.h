// LAS files as bytes, for tests.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "tests/support/files/data_files.h"

namespace telesplat::data::test {

struct LasPoint {
  int32_t x = 0, y = 0, z = 0;  ///< in hundredths of a unit
  uint16_t intensity = 0;
  uint8_t returns = 0x11, classes = 0;  ///< bytes 14 and 15 of formats 0 to 5
  uint16_t red = 0, green = 0, blue = 0;
};

/// A record in front of the points.
inline std::string las_record(const std::string& user, uint16_t id, const std::string& body) {
  std::string out(54, '\0');
  out.replace(2, user.size(), user).replace(18, 2, raw(id)).replace(20, 2, raw(uint16_t(body.size())));
  return out + body;
}

/// LAS 1.2 with points of format 2 and these records. count: as the header claims it, -1: as it is.
inline std::string las_file(const std::vector<LasPoint>& points, const std::vector<std::string>& records = {},
                            int64_t count = -1, const std::string& more_of_point = "") {
  std::string header(227, '\0'), body;
  for (const std::string& record : records) body += record;
  const auto put = [&](size_t at, const std::string& bytes) { header.replace(at, bytes.size(), bytes); };
  put(0, "LASF"), put(24, "\1\2"), put(94, raw(uint16_t{227})), put(96, raw(uint32_t(227 + body.size())));
  put(100, raw(uint32_t(records.size()))), put(104, "\2"), put(105, raw(uint16_t(26 + more_of_point.size())));
  put(107, raw(uint32_t(count < 0 ? points.size() : size_t(count))));
  for (size_t a = 0; a < 3; ++a) put(131 + 8 * a, raw(0.01));
  for (const LasPoint& p : points)
    body += raw(p.x) + raw(p.y) + raw(p.z) + raw(p.intensity) + raw(p.returns) + raw(p.classes) + std::string(4, '\0') +
            raw(p.red) + raw(p.green) + raw(p.blue) + more_of_point;
  return header + body;
}

}  // namespace telesplat::data::test
