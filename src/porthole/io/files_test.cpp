#include "porthole/io/files.h"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <thread>

#include <gtest/gtest.h>

#include "porthole/base/error.h"
#include "support/temporary_folder.h"

namespace porthole {
namespace {

using test::content_of;
using test::TemporaryFolder;

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

/// Code of the error that `f` throws, "none" if none.
template <typename F> std::string code_of(F&& f) {
    try {
        f();
    } catch (const Error& error) {
        return error.code;
    }
    return "none";
}

std::size_t files_in(const std::filesystem::path& folder) {
    return std::size_t(std::distance(std::filesystem::directory_iterator(folder), {}));
}

TEST(FileBytes, ReadsWhatIsThere) {
    const TemporaryFolder folder;
    std::string content = "head";
    content.append(3000, '\0');
    content += "tail";
    EXPECT_EQ(FileBytes(folder.write("a", content)).text(), content);
}

TEST(FileBytes, LargeFilesAreMapped) {
    const TemporaryFolder folder;
    const std::filesystem::path file = folder.write("large", "begin");
    const std::uint64_t size = (std::uint64_t(65) << 20) + 3;
    std::filesystem::resize_file(file, size);
    const FileBytes read(file);
    EXPECT_EQ(read.bytes().size(), size);
    EXPECT_EQ(read.text().substr(0, 6), std::string_view("begin\0", 6));
}

TEST(FileBytes, MovesKeepTheBytes) {
    // Short strings live inside their object and move with it.
    FileBytes small(std::string("abc"));
    FileBytes taken(std::move(small));
    EXPECT_EQ(taken.text(), "abc");
    const TemporaryFolder folder;
    FileBytes file(folder.write("a", "from a file"));
    taken = std::move(file);
    EXPECT_EQ(taken.text(), "from a file");
    file = FileBytes(std::string("xyz"));
    EXPECT_EQ(file.text(), "xyz");
}

TEST(FileBytes, SaysWhatIsWrong) {
    const TemporaryFolder folder;
    EXPECT_EQ(code_of([&] { FileBytes f(folder.path() / "absent"); }), "E0201");
    EXPECT_EQ(code_of([&] { FileBytes f(folder.write("file", "x") / "below"); }), "E0201");
    EXPECT_EQ(code_of([&] { FileBytes f(folder.path()); }), "E0202");
    EXPECT_EQ(code_of([&] { FileBytes f(std::filesystem::path("/dev/zero")); }), "E0202");
    EXPECT_EQ(code_of([&] { FileBytes f(folder.write("empty", "")); }), "E0203");
}

TEST(FileBytes, ReadsPipesUpToALimit) {
    const TemporaryFolder folder;
    const std::filesystem::path pipe = folder.path() / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    const std::string content(3'000'000, 'p');
    const auto send = [&] {
        std::ofstream out(pipe, std::ios::binary);
        out << content;
    };
    {
        const std::jthread writer(send);
        EXPECT_EQ(FileBytes(pipe).text(), content);
    }
    struct sigaction ignore {
    }, before{};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before); // the reader hangs up on the writer
    {
        const std::jthread writer(send);
        EXPECT_EQ(code_of([&] { FileBytes f(pipe, 1'000'000); }), "E0902");
    }
    ::sigaction(SIGPIPE, &before, nullptr);
}

TEST(ResolveBeside, FindsFilesBelowTheModel) {
    const TemporaryFolder folder;
    const std::filesystem::path model = folder.write("model.gltf", "{}");
    const auto expect = [&](const std::string& reference, const std::string& file) {
        EXPECT_EQ(resolve_beside(model, reference, "here"), folder.path() / file) << reference;
    };
    folder.write("a b.png", "x");
    expect("a b.png", "a b.png");
    expect("a%20b.png", "a b.png");
    expect("./sub/../a%20b.png", "a b.png");
    folder.write("sub/c.png", "x");
    expect("sub/c.png", "sub/c.png");
    expect("sub\\c.png", "sub/c.png");
    expect("sub%2Fc.png", "sub/c.png");
    expect("../" + folder.path().filename().string() + "/sub/c.png", "sub/c.png"); // out and in again
    folder.write("100%.png", "x");
    expect("100%.png", "100%.png");
    folder.write("%41.png", "x");
    expect("%41.png", "%41.png"); // a plain name, as A.png does not exist
    std::filesystem::create_symlink("a b.png", folder.path() / "link.png");
    expect("link.png", "a b.png");
}

TEST(ResolveBeside, NeverLeavesTheFolder) {
    const TemporaryFolder outer;
    outer.write("secret.png", "x");
    outer.write("inner-too/secret.png", "x");
    const std::filesystem::path model = outer.write("inner/model.gltf", "{}");
    outer.write("inner/sub/x.png", "x");
    std::filesystem::create_symlink(outer.path() / "secret.png", outer.path() / "inner/link.png");
    std::filesystem::create_symlink(outer.path(), outer.path() / "inner/up");
    ASSERT_EQ(::mkfifo((outer.path() / "inner/pipe").c_str(), 0600), 0);
    std::filesystem::create_symlink("/dev/zero", outer.path() / "inner/zero");
    const std::string absolute = (outer.path() / "inner/sub/x.png").string();
    for (const std::string_view reference : {std::string_view("../secret.png"),
                                             std::string_view("%2e%2e/secret.png"),
                                             std::string_view("..%2Fsecret.png"),
                                             std::string_view("..\\secret.png"),
                                             std::string_view("sub/../../secret.png"),
                                             std::string_view("../inner-too/secret.png"),

                                             std::string_view("link.png"),
                                             std::string_view("up/secret.png"),
                                             std::string_view("/etc/passwd"),
                                             std::string_view("%2Fetc%2Fpasswd"),
                                             std::string_view("C:\\x.png"),
                                             std::string_view("file:///etc/passwd"),
                                             std::string_view("http://localhost/x.png"),
                                             std::string_view("data:image/png;base64,AAAA"),
                                             std::string_view("pipe"),
                                             std::string_view("zero"),
                                             std::string_view("sub"),
                                             std::string_view("."),
                                             std::string_view("sub/x.png\0.jpg", 14),
                                             std::string_view("sub/x.png%00.jpg"),
                                             std::string_view(absolute)})
        EXPECT_EQ(code_of([&] { (void)resolve_beside(model, reference, "here"); }), "E0210") << reference;
    EXPECT_EQ(code_of([&] { (void)resolve_beside(model, "absent.png", "here"); }), "E0211");
    EXPECT_EQ(code_of([&] { (void)resolve_beside(model, "", "here"); }), "E0211");
    EXPECT_EQ(code_of([&] { (void)resolve_beside("-", "sub/x.png", "here"); }), "E0210");
}

TEST(WriteFile, ReplacesAsAWhole) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "out.bin").string();
    write_file(file, bytes("one"));
    EXPECT_EQ(content_of(file), "one");
    ASSERT_EQ(::chmod(file.c_str(), 0640), 0);
    write_file(file, bytes("second"));
    EXPECT_EQ(content_of(file), "second");
    EXPECT_EQ(files_in(folder.path()), 1u) << "a temporary file was left";
    struct stat status {};
    ASSERT_EQ(::stat(file.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777u, 0640u);
}

TEST(WriteFile, NoClobberKeepsTheOldFile) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "out.bin").string();
    write_file(file, bytes("first"), true);
    EXPECT_EQ(code_of([&] { write_file(file, bytes("second"), true); }), "E0803");
    EXPECT_EQ(content_of(file), "first");
    EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(WriteFile, OneOfManyWritersWinsWithNoClobber) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "out.bin").string();
    std::atomic<int> written{0};
    {
        std::vector<std::jthread> writers;
        writers.reserve(8);
        for (int i = 0; i < 8; ++i)
            writers.emplace_back([&, i] {
                const std::string content(1000, char('a' + i));
                if (code_of([&] { write_file(file, bytes(content), true); }) == "none") ++written;
            });
    }
    EXPECT_EQ(written, 1);
    EXPECT_EQ(content_of(file).size(), 1000u);
    EXPECT_EQ(files_in(folder.path()), 1u);
}

TEST(WriteFile, KeepsSymbolicLinks) {
    const TemporaryFolder folder;
    folder.write("real/out.bin", "old");
    const std::filesystem::path link = folder.path() / "link.bin";
    std::filesystem::create_symlink("real/out.bin", link);
    write_file(link.string(), bytes("new"));
    EXPECT_TRUE(std::filesystem::is_symlink(link));
    EXPECT_EQ(content_of(folder.path() / "real/out.bin"), "new");
}

TEST(WriteFile, WritesIntoPipesInsteadOfReplacingThem) {
    const TemporaryFolder folder;
    const std::filesystem::path pipe = folder.path() / "pipe";
    ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
    std::string received;
    {
        const std::jthread reader([&] { received = content_of(pipe); });
        write_file(pipe.string(), bytes("through"));
    }
    EXPECT_EQ(received, "through");
    EXPECT_TRUE(std::filesystem::is_fifo(pipe));
}

TEST(WriteFile, SaysWhatIsWrong) {
    const TemporaryFolder folder;
    EXPECT_EQ(code_of([&] { write_file(folder.path().string(), bytes("x")); }), "E0801");
    EXPECT_EQ(code_of([&] { write_file((folder.path() / "absent/out").string(), bytes("x")); }), "E0801");
    EXPECT_EQ(code_of([&] { write_file("/dev/full", bytes("x")); }), "E0802");
}

TEST(WriteFile, AFullDiskLeavesTheOldFile) {
    const TemporaryFolder folder;
    const std::string file = (folder.path() / "out.bin").string();
    write_file(file, bytes("old"));
    // A file size limit stands for the full disk: writing stops half-way in the same place.
    struct rlimit before {};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    struct sigaction ignore {
    }, old_action{};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGXFSZ, &ignore, &old_action);
    const struct rlimit small { 4096, before.rlim_max };
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const std::string code = code_of([&] { write_file(file, bytes(std::string(100'000, 'x'))); });
    ::setrlimit(RLIMIT_FSIZE, &before);
    ::sigaction(SIGXFSZ, &old_action, nullptr);
    EXPECT_EQ(code, "E0802");
    EXPECT_EQ(content_of(file), "old");
    EXPECT_EQ(files_in(folder.path()), 1u) << "a temporary file was left";
}

TEST(Utf8, InvalidSequencesBecomeReplacementCharacters) {
    EXPECT_EQ(valid_utf8("plain \xC3\xA4 \xE2\x82\xAC \xF0\x9F\x98\x80"),
              "plain \xC3\xA4 \xE2\x82\xAC \xF0\x9F\x98\x80");
    EXPECT_EQ(valid_utf8("a\xFF"
                         "b"),
              "a\xEF\xBF\xBD"
              "b");
    EXPECT_EQ(valid_utf8("\xE4hnlich"), "\xEF\xBF\xBDhnlich");                     // Latin-1
    EXPECT_EQ(valid_utf8("\xC0\xAF"), "\xEF\xBF\xBD\xEF\xBF\xBD");                 // overlong '/'
    EXPECT_EQ(valid_utf8("\xED\xA0\x80"), "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD"); // surrogate
    EXPECT_EQ(valid_utf8("\xF4\x90\x80\x80").size(), 12u);                         // past U+10FFFF
    EXPECT_EQ(valid_utf8("\xE2\x82"), "\xEF\xBF\xBD");                             // cut short
    EXPECT_EQ(valid_utf8("\xE2\x82x"), "\xEF\xBF\xBDx");
    EXPECT_EQ(valid_utf8(std::string_view("a\0b", 3)), std::string("a\0b", 3));
}

TEST(Utf8, EscapedIsSafeToShow) {
    EXPECT_EQ(escaped("a\nb\r\tc"), "a\\nb\\r\\tc");
    EXPECT_EQ(escaped("\x1b[31mred\x07"), "\\x1b[31mred\\x07");
    EXPECT_EQ(escaped("\xE2\x80\xAEgpj.exe"), "\\u202egpj.exe");
    EXPECT_EQ(escaped("\xC2\x9B"
                      "31m"),
              "\\u009b31m");
    EXPECT_EQ(escaped(std::string_view("\0", 1)), "\\x00");
    EXPECT_EQ(escaped("\xE2\x80\xA8"), "\\u2028");
    EXPECT_EQ(escaped("\xC3\xA4 \xE2\x82\xAC"), "\xC3\xA4 \xE2\x82\xAC");
}

TEST(Utf8, EscapedKeepsItsLimit) {
    const std::string text = "0123456789\xE2\x82\xAC\nabcdefghij";
    for (std::size_t limit = 0; limit < 40; ++limit) {
        const std::string out = escaped(text, limit);
        EXPECT_LE(out.size(), limit);
        EXPECT_EQ(valid_utf8(out), out);
        EXPECT_EQ(out.find('\n'), std::string::npos);
    }
    EXPECT_EQ(escaped("abcdef", 6), "abcdef");
    EXPECT_EQ(escaped("abcdefg", 6), "abc...");
}

} // namespace
} // namespace porthole
