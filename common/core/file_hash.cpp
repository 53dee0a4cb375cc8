#include "common/core/file_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

namespace telesplat {

std::string hash_text(uint64_t hash) { return fmt::format("xxh3:{:016x}", hash); }

Result<FileHash> hash_of_files(const std::vector<std::string>& paths, const std::function<bool()>& go_on) {
  const std::unique_ptr<XXH3_state_t, XXH_errorcode (*)(XXH3_state_t*)> state(XXH3_createState(), XXH3_freeState);
  XXH3_64bits_reset(state.get());
  FileHash out;
  std::vector<char> part(1 << 20);
  for (const std::string& path : paths) {
    const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
    if (!file) return Error{fmt::format("{}: cannot be read: {}", path, std::strerror(errno))};
    for (size_t n; (n = std::fread(part.data(), 1, part.size(), file.get())) > 0;) {
      XXH3_64bits_update(state.get(), part.data(), n);
      out.bytes += n;
      if (go_on && !go_on()) return Error{fmt::format("{}: was not read to its end", path)};
    }
    if (std::ferror(file.get())) return Error{fmt::format("{}: cannot be read", path)};
  }
  out.hash = XXH3_64bits_digest(state.get());
  return out;
}

}  // namespace telesplat
