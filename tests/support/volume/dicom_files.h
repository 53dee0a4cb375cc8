// DICOM files of many frames, and compressed ones, for tests.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/support/volume/files.h"

namespace telesplat::data::test {

/// Values that a frame of a pattern states.
struct EnhancedFrame {
  int k = 0;  ///< slice of the pattern
  std::string slope = "1", intercept = "0";
  int temporal_position = 0;
};

/// Options for writing frames into one file.
struct Enhanced {
  DicomWriter::Syntax syntax = DicomWriter::Syntax::kExplicit;
  bool undefined = true;            ///< sequences have no lengths
  bool groups = true;               ///< frames have functional groups
  std::string offsets = {};         ///< Grid Frame Offset Vector
  std::string syntax_uid = {};      ///< instead of the syntax's
  std::string claimed_frames = {};  ///< instead of the real number
  std::vector<EnhancedFrame> frames = {};
};

inline std::string enhanced_dicom(const Pattern& p, const Enhanced& e) {
  const glm::dmat4& m = p.index_to_data;
  const auto s = spacing_of(m);
  const auto in_sequence = [&](uint32_t tag, auto&& write) {
    DicomWriter inner = DicomWriter::item(e.syntax), outer = DicomWriter::item(e.syntax);
    write(inner);
    outer.put_sequence(tag, {inner.content()}, e.undefined);
    return outer.content();
  };
  const std::string orientation = three(m[0] / s[0], "\\") + "\\" + three(m[1] / s[1], "\\");
  DicomWriter w(e.syntax, e.syntax_uid);
  w.put(0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.4.1");
  w.put(0x00080018, "UI", "1.2.3.1");
  w.put(0x00080060, "CS", "MR");
  w.put(0x0020000e, "UI", "1.2.3");
  w.put(0x00200013, "IS", "1");
  if (!e.offsets.empty()) w.put(0x00200032, "DS", three(m[3], "\\"));
  if (!e.offsets.empty()) w.put(0x00200037, "DS", orientation);
  w.put16(0x00280002, 1);
  w.put(0x00280004, "CS", "MONOCHROME2");
  w.put(0x00280008, "IS", e.claimed_frames.empty() ? std::to_string(e.frames.size()) : e.claimed_frames);
  w.put16(0x00280010, uint16_t(p.size[1]));
  w.put16(0x00280011, uint16_t(p.size[0]));
  w.put16(0x00280100, 16);
  w.put16(0x00280101, 16);
  w.put16(0x00280102, 15);
  w.put16(0x00280103, 1);
  if (!e.offsets.empty()) w.put(0x3004000c, "DS", e.offsets);
  std::vector<std::string> per_frame;
  std::string pixels;
  for (const EnhancedFrame& f : e.frames) {
    const auto said = [&](uint32_t tag, const char* type, const std::string& value) {
      return [=](DicomWriter& to) { to.put(tag, type, value); };
    };
    per_frame.push_back(
        in_sequence(0x00209111, said(0x00209128, "UL",
                                     raw(uint32_t(f.temporal_position), e.syntax == DicomWriter::Syntax::kBigEndian))) +
        in_sequence(0x00209113, said(0x00200032, "DS", three(m * glm::dvec4(0, 0, f.k, 1), "\\"))) +
        in_sequence(0x00289145, [&](DicomWriter& to) {
          to.put(0x00281052, "DS", f.intercept);
          to.put(0x00281053, "DS", f.slope);
        }));
    for (int j = 0; j < p.size[1]; ++j)
      for (int i = 0; i < p.size[0]; ++i)
        pixels += raw(int16_t(p.value(i, j, f.k)), e.syntax == DicomWriter::Syntax::kBigEndian);
  }
  if (e.groups) {
    const auto shared = in_sequence(0x00209116, [&](DicomWriter& to) { to.put(0x00200037, "DS", orientation); }) +
                        in_sequence(0x00289110, [&](DicomWriter& to) {
                          to.put(0x00280030, "DS", fmt::format("{:.12g}\\{:.12g}", s[1], s[0]));
                        });
    w.put_sequence(0x52009229, {shared}, e.undefined);
    w.put_sequence(0x52009230, per_frame, e.undefined);
  }
  w.put(0x7fe00010, "OW", pixels);
  return w.content();
}

}  // namespace telesplat::data::test
