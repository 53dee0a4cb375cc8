#include "services/data/import/dicom.h"

#include <fmt/format.h>
#include <gdcmImageReader.h>

#include <cmath>
#include <istream>
#include <streambuf>

namespace telesplat::data {
namespace {

// A stream over memory, without a copy.
class View final : public std::streambuf {
 public:
  explicit View(std::string_view content) {
    char* begin = const_cast<char*>(content.data());
    setg(begin, begin, begin + content.size());
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const off_type base = from == std::ios_base::beg ? 0 : from == std::ios_base::cur ? gptr() - eback() : size();
    const off_type to = base + offset;
    if (to < 0 || to > size()) return pos_type(off_type(-1));
    setg(eback(), eback() + to, egptr());
    return pos_type(to);
  }
  pos_type seekpos(pos_type to, std::ios_base::openmode mode) override {
    return seekoff(off_type(to), std::ios_base::beg, mode);
  }

 private:
  off_type size() const { return egptr() - eback(); }
};

// Replaces three bytes per pixel by one, in place; input is interleaved, or plane by plane within each frame.
void make_grey(std::vector<char>& pixels, size_t per_frame, bool planes, bool luma_first) {
  const auto* from = reinterpret_cast<const unsigned char*>(pixels.data());
  const size_t count = pixels.size() / 3;
  std::vector<char> grey(count);
  for (size_t i = 0; i < count; ++i) {
    const unsigned char* p = planes ? from + i / per_frame * 3 * per_frame + i % per_frame : from + 3 * i;
    const size_t next = planes ? per_frame : 1;
    grey[i] = char(luma_first ? p[0] : std::lround(0.299 * p[0] + 0.587 * p[next] + 0.114 * p[2 * next]));
  }
  pixels = std::move(grey);
}

}  // namespace

Result<DicomFrames> decode_dicom(std::string_view content, const std::string& path) {
  View view(content);
  std::istream stream(&view);
  gdcm::ImageReader reader;
  reader.SetStream(stream);
  if (!reader.Read()) return Error{path + ": GDCM cannot read its elements"};
  const gdcm::Image& image = reader.GetImage();
  const std::string syntax = gdcm::TransferSyntax::GetTSString(image.GetTransferSyntax());
  const unsigned dimensions = image.GetNumberOfDimensions();
  const gdcm::PixelFormat format = image.GetPixelFormat();
  DicomFrames out;
  out.columns = int(image.GetDimension(0)), out.rows = int(image.GetDimension(1));
  out.frames = dimensions > 2 ? int(image.GetDimension(2)) : 1;
  out.bytes = format.GetBitsAllocated() / 8;
  out.pixels.resize(image.GetBufferLength());
  if (!image.GetBuffer(out.pixels.data()))
    return Error{fmt::format("{}: its pixels, of transfer syntax {}, are damaged or of a kind that GDCM cannot unpack",
                             path, syntax)};
  if (format.GetSamplesPerPixel() == 1) return out;
  if (format.GetSamplesPerPixel() != 3 || out.bytes != 1)
    return Error{fmt::format("{}: has {} components of {} bytes a pixel; supported are 3 of 1", path,
                             format.GetSamplesPerPixel(), out.bytes)};
  const gdcm::PhotometricInterpretation photometric = image.GetPhotometricInterpretation();
  const bool luma = photometric == gdcm::PhotometricInterpretation::YBR_FULL ||
                    photometric == gdcm::PhotometricInterpretation::YBR_FULL_422;
  make_grey(out.pixels, size_t(out.columns) * size_t(out.rows), image.GetPlanarConfiguration() == 1, luma);
  return out;
}

}  // namespace telesplat::data
