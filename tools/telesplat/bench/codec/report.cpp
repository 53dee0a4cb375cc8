#include "tools/telesplat/bench/codec/report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace telesplat::launcher {
namespace {

double per_pixel(size_t bits, size_t pixels) { return pixels > 0 ? double(bits) / double(pixels) : 0; }
double ratio(size_t a, size_t b) { return b > 0 ? double(a) / double(b) : 0; }

// Bits of a coder that was measured; 0: it was not.
size_t bits_of(const CodecReport& report, const std::string& coder) {
  for (const BaselineReport& b : report.baselines)
    if (b.coder->name == coder && b.missing.empty()) return b.bits.all();
  return 0;
}

std::string share(size_t bits, size_t of) { return of > 0 ? fmt::format("{:.3f}", ratio(bits, of)) : "-"; }

std::string baseline_row(const CodecReport& r, const BaselineReport& b) {
  if (!b.missing.empty()) return fmt::format("| {} | {} |||||||||\n", b.coder->title, b.missing);
  const auto bits = [&](size_t n) { return fmt::format("{:.3f}", per_pixel(n, r.covered)); };
  if (b.coder->depth_only)
    return fmt::format("| {} | {} | - | - | - | - | - | - | - | - |\n", b.coder->title, bits(b.bits.depth));
  const size_t all = b.bits.all();
  return fmt::format("| {} | {} | {} | {} | - | - | - | {} | {} | {} |\n", b.coder->title, bits(b.bits.depth),
                     bits(b.bits.normal), bits(b.bits.colour), bits(all), share(all, bits_of(r, "lzw")),
                     share(all, bits_of(r, "tiff")));
}

std::string size_table(const CodecReport& r) {
  const auto bits = [&](size_t n) { return fmt::format("{:.3f}", per_pixel(n, r.covered)); };
  std::string out =
      "| bits a covered pixel | depth | normal | colour | mask | sparse tiles | headers | all | of LZW | of TIFF |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n";
  const auto row = [&](const std::string& name, const StreamBits& s) {
    out += fmt::format("| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n", name, bits(s.depth), bits(s.normal),
                       bits(s.colour), bits(s.mask), bits(s.sparse), bits(s.header), bits(s.all()),
                       share(s.all(), bits_of(r, "lzw")), share(s.all(), bits_of(r, "tiff")));
  };
  row("telesplat", r.bits);
  if (!r.wish.exact()) {
    row("within bounds", r.bounded);
    out += fmt::format("| refinement | - | - | - | - | - | - | {} | {} | {} |\n", bits(r.refinement),
                       share(r.refinement, bits_of(r, "lzw")), share(r.refinement, bits_of(r, "tiff")));
  }
  for (const BaselineReport& b : r.baselines) out += baseline_row(r, b);
  return out;
}

std::string speed_table(const std::vector<TargetSpeed>& speeds, const std::string& what) {
  std::string head = "| " + what, line = "|---", encode = "| encode", decode = "| decode";
  for (const TargetSpeed& s : speeds) {
    head += " | " + s.target;
    line += "|---";
    encode += fmt::format(" | {:.1f}", s.encode);
    decode += fmt::format(" | {:.1f}", s.decode);
  }
  return head + " |\n" + line + "|\n" + encode + " |\n" + decode + " |\n";
}

std::string error_line(const CodecErrors& e) {
  if (e.none()) return "errors: 0, lossless\n";
  return fmt::format(
      "errors, largest and mean: depth {:.4f} and {:.5f} px; normals {:.0f} and {:.3f} codes, {:.2f} and {:.3f} "
      "degrees; "
      "colours {:.0f} and {:.3f} codes; {} pixels covered in one image alone\n",
      e.depth_px.largest, e.depth_px.mean(e.pixels), e.normal_codes.largest, e.normal_codes.mean(e.pixels),
      e.normal_deg.largest, e.normal_deg.mean(e.pixels), e.colour_codes.largest, e.colour_codes.mean(e.pixels),
      e.uncovered);
}

nlohmann::json speeds_json(const std::vector<TargetSpeed>& speeds) {
  nlohmann::json out = nlohmann::json::object();
  for (const TargetSpeed& s : speeds) out[s.target] = {{"encode_mpx_s", s.encode}, {"decode_mpx_s", s.decode}};
  return out;
}

nlohmann::json figure_json(const ErrorFigure& figure, size_t count) {
  return {{"largest", figure.largest}, {"mean", figure.mean(count)}};
}

}  // namespace

std::string to_markdown(const CodecReport& r) {
  std::string out = fmt::format("{}: {} images, {:.2f} Mpx, {:.2f} covered in {} tiles, {} of them full\n\n", r.name,
                                r.frames, double(r.pixels) * 1e-6, double(r.covered) * 1e-6, r.tiles, r.full_tiles);
  out += size_table(r) + "\n";
  if (!r.speeds.empty())
    out +=
        speed_table(r.speeds, fmt::format("Mpx/s, {} tiles, {:.0f} % covered", r.timed_tiles, 100 * r.timed_covered)) +
        "\n";
  else
    out += "speeds are not measured: no tile is half covered, or --seconds is 0\n";
  if (!r.bounded_speeds.empty()) out += speed_table(r.bounded_speeds, "Mpx/s within bounds") + "\n";
  if (!r.refinement_speeds.empty()) out += speed_table(r.refinement_speeds, "Mpx/s of refinements") + "\n";
  if (!r.wish.exact())
    out += fmt::format("bounds: depth {:.4f} px; normals {} codes, {:.2f} degrees; colours {} codes\n", r.wish.depth_px,
                       r.wish.normal, codec::normal_error_degrees(r.wish.normal), r.wish.colour);
  return out + error_line(r.errors);
}

std::string to_markdown(const SliceReport& r) {
  std::string out = fmt::format("{}: {} views, {} slice images, {:.2f} Mpx, {:.2f} not transparent\n\n", r.name,
                                r.views, r.images, double(r.pixels) * 1e-6, double(r.covered) * 1e-6);
  out += "| bits a pixel that is not transparent | all | of zstd |\n|---|---|---|\n";
  out += fmt::format("| telesplat | {:.3f} | {} |\n| zstd -3 | {:.3f} | 1.000 |\n\n", per_pixel(r.bits, r.covered),
                     share(r.bits, r.zstd_bits), per_pixel(r.zstd_bits, r.covered));
  if (!r.speeds.empty()) out += speed_table(r.speeds, "Mpx/s, not transparent") + "\n";
  return out + (r.wrong == 0 ? "errors: 0, lossless\n" : fmt::format("errors: {} pixels differ\n", r.wrong));
}

nlohmann::json to_json(const CodecReport& r) {
  const auto bits = [&](size_t n) { return per_pixel(n, r.covered); };
  nlohmann::json coders;
  const StreamBits& s = r.bits;
  coders["telesplat"] = {{"depth", bits(s.depth)}, {"normal", bits(s.normal)}, {"colour", bits(s.colour)},
                         {"mask", bits(s.mask)},   {"sparse", bits(s.sparse)}, {"header", bits(s.header)},
                         {"all", bits(s.all())},   {"bytes", s.all() / 8}};
  if (!r.wish.exact()) {
    const StreamBits& b = r.bounded;
    coders["bounded"] = {{"depth", bits(b.depth)}, {"normal", bits(b.normal)}, {"colour", bits(b.colour)},
                         {"mask", bits(b.mask)},   {"sparse", bits(b.sparse)}, {"header", bits(b.header)},
                         {"all", bits(b.all())},   {"bytes", b.all() / 8}};
    coders["refinement"] = {{"all", bits(r.refinement)}, {"bytes", r.refinement / 8}};
  }
  for (const BaselineReport& b : r.baselines) {
    nlohmann::json& to = coders[b.coder->name];
    if (!b.missing.empty()) {
      to = {{"missing", b.missing}};
      continue;
    }
    to = {{"depth", bits(b.bits.depth)}};
    if (b.coder->depth_only) continue;
    to["normal"] = bits(b.bits.normal), to["colour"] = bits(b.bits.colour), to["all"] = bits(b.bits.all());
    to["ratio"] = ratio(s.all(), b.bits.all());
  }
  const CodecErrors& e = r.errors;
  return {{"name", r.name},
          {"kind", "depth"},
          {"images", r.frames},
          {"tiles", r.tiles},
          {"full_tiles", r.full_tiles},
          {"pixels", r.pixels},
          {"covered_pixels", r.covered},
          {"bits_per_pixel", coders},
          {"timed_tiles", r.timed_tiles},
          {"timed_covered", r.timed_covered},
          {"speeds", speeds_json(r.speeds)},
          {"bounded_speeds", speeds_json(r.bounded_speeds)},
          {"refinement_speeds", speeds_json(r.refinement_speeds)},
          {"bounds", {{"depth_px", r.wish.depth_px}, {"normal", r.wish.normal}, {"colour", r.wish.colour}}},
          {"errors",
           {{"uncovered", e.uncovered},
            {"depth_px", figure_json(e.depth_px, e.pixels)},
            {"normal_codes", figure_json(e.normal_codes, e.pixels)},
            {"normal_deg", figure_json(e.normal_deg, e.pixels)},
            {"colour_codes", figure_json(e.colour_codes, e.pixels)}}}};
}

nlohmann::json to_json(const SliceReport& r) {
  return {
      {"name", r.name},
      {"kind", "slices"},
      {"views", r.views},
      {"images", r.images},
      {"pixels", r.pixels},
      {"covered_pixels", r.covered},
      {"bits_per_pixel", {{"telesplat", per_pixel(r.bits, r.covered)}, {"zstd", per_pixel(r.zstd_bits, r.covered)}}},
      {"speeds", speeds_json(r.speeds)},
      {"errors", {{"pixels", r.wrong}}}};
}

}  // namespace telesplat::launcher
