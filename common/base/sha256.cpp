#include "common/base/sha256.h"

#include <openssl/evp.h>

#include <array>
#include <stdexcept>

#include "common/base/byte_stream.h"

namespace archetide {
namespace {

void demand(int success) {
  if (success != 1) throw std::runtime_error("SHA-256: OpenSSL's libcrypto refuses to hash");
}

}  // namespace

void Sha256::Free::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

Sha256::Sha256() : context_(EVP_MD_CTX_new()) {
  demand(context_ != nullptr);
  demand(EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr));
}

void Sha256::update(const void* data, std::size_t bytes) {
  demand(EVP_DigestUpdate(context_.get(), data, bytes));
}

std::string Sha256::hex() {
  std::array<unsigned char, 32> digest;
  demand(EVP_DigestFinal_ex(context_.get(), digest.data(), nullptr));
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : digest) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::string sha256_hex(std::string_view text) {
  Sha256 hash;
  hash.update(text);
  return hash.hex();
}

std::string sha256_of_file(const std::string& path) {
  Sha256 hash;
  read_file_in_blocks(path, [&](std::string_view block) { hash.update(block); });
  return hash.hex();
}

}  // namespace archetide
