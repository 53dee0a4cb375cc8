// Walking over the values behind the header of a PLY file.
#pragma once

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

#include "services/data/base/text_scanner.h"
#include "services/data/mesh/formats/ply_header.h"

namespace telesplat::data {

// Reads values, one or `count` of a type, from the data behind the header. read() returns false where the data ends or
// is no number.
class AsciiCursor {
 public:
  AsciiCursor(std::string_view content, size_t offset) : scan_(content.substr(offset)) {}
  bool read(PlyType, double& out) { return scan_.skip_space() && scan_.number(out); }
  bool read(PlyType type, uint64_t count, std::vector<double>& out) {
    out.clear();
    double item;
    for (; out.size() < count && read(type, item);) out.push_back(item);  // a lying count ends at the file's end
    return out.size() == count;
  }

 private:
  TextScanner scan_;
};

template <bool kSwap>
class BinaryCursor {
 public:
  BinaryCursor(std::string_view content, size_t offset)
      : at_(content.data() + offset), end_(content.data() + content.size()) {}
  [[gnu::always_inline]] bool read(PlyType type, double& out) {
    return with_type(type, [&](auto zero) { return take<decltype(zero)>(1, &out); });
  }
  [[gnu::always_inline]] bool read(PlyType type, uint64_t count, std::vector<double>& out) {
    if (count > static_cast<uint64_t>(end_ - at_) / kPlyTypeBytes[static_cast<int>(type)]) return false;
    out.resize(count);
    return with_type(type, [&](auto zero) { return take<decltype(zero)>(count, out.data()); });
  }

 private:
  template <class Body>
  [[gnu::always_inline]] static bool with_type(PlyType type, const Body& body) {
    switch (type) {
      case PlyType::kInt8:
        return body(int8_t{});
      case PlyType::kUint8:
        return body(uint8_t{});
      case PlyType::kInt16:
        return body(int16_t{});
      case PlyType::kUint16:
        return body(uint16_t{});
      case PlyType::kInt32:
        return body(int32_t{});
      case PlyType::kUint32:
        return body(uint32_t{});
      case PlyType::kInt64:
        return body(int64_t{});
      case PlyType::kUint64:
        return body(uint64_t{});
      case PlyType::kFloat32:
        return body(float{});
      case PlyType::kFloat64:
        return body(double{});
    }
    return false;
  }
  template <class T>
  bool take(size_t count, double* out) {
    if (static_cast<size_t>(end_ - at_) < count * sizeof(T)) return false;
    for (size_t i = 0; i < count; ++i, at_ += sizeof(T)) {
      char bytes[sizeof(T)];
      std::memcpy(bytes, at_, sizeof(T));
      if constexpr (kSwap) std::reverse(bytes, bytes + sizeof(T));
      T value;
      std::memcpy(&value, bytes, sizeof(T));
      out[i] = static_cast<double>(value);
    }
    return true;
  }
  const char* at_;
  const char* end_;
};

}  // namespace telesplat::data
