"""tests/lint/words.py finds words of our own in identifiers, and only there."""

import words


def test_parts_of_identifiers_are_found_once_with_their_line():
    text = "int a;\nvoid told_last(TokenBook& kGlow);\ntold_last();\n"

    assert words.violations("x.cpp", text) == [(2, "told_last", "told"), (2, "TokenBook", "book"), (2, "kGlow", "glow")]


def test_comments_texts_and_includes_are_left_alone():
    assert words.violations("x.cpp", '#include "glow.h"\n// told\n/* a book */ f("liar", \'k\', R"(kit)");\nint kitten, mistold;\n') == []


def test_an_exception_holds_for_its_file_alone():
    assert words.violations("worker/render/vdb/vdb_module.cpp", "void say();") == []
    assert words.violations("worker/render/vdb/other.cpp", "void say();") == [(1, "say", "say")]


def test_every_word_of_the_list_can_be_found():
    for word in words.WORDS:
        assert words.violations("x.cpp", f"int {word}_x;") == [(1, f"{word}_x", word)]
