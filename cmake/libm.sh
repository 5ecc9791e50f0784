#!/usr/bin/env bash
# Makes an archive of the C library's mathematical functions that programs can link on x86-64, so that their results travel with
# them: glibc 2.41 rounds expm1f and a dozen other functions otherwise than the versions before.
#   cmake/libm.sh LIBM_A OUT_A NM OBJCOPY AR CC
# The functions of libm.a of which there is a version with fused multiply-add choose between versions when a program starts, by a
# table of the C library that static programs alone can reach. Here each is a jump to the version with fused multiply-add, which
# every processor of x86-64-v3 has, and which the shared library chooses there: the bits are those of the shared library. Other
# functions that choose (floor, rint and the like, whose results are exact) are left to the shared library. `errno`, by which the
# functions report errors that nobody here reads, becomes a variable of the archive.
set -euo pipefail
[ $# = 6 ] || { sed -n '2,11s/^# \{0,1\}//p' "$0" >&2; exit 2; }
libm="$(realpath "$1")" out="$2" nm="$3" objcopy="$4" ar="$5" cc="$6"
case "$out" in /*) ;; *) out="$PWD/$out" ;; esac

work="$(mktemp -d)"
trap 'rm -rf "$work" "$out.new"' EXIT
cd "$work"
# libm.a may be a script of the linker: GROUP ( .../libm-2.36.a .../libmvec.a )
if head -c 8 "$libm" | grep -q '^!<arch>'; then archive="$libm"
else archive="$(grep -o '/[^ ]*/libm-[0-9.]*\.a' "$libm")" || { echo "error: $libm is no archive and names none" >&2; exit 1; }
fi
"$objcopy" --redefine-sym errno=ls_libm_errno "$archive" "$out.new"
"$nm" -A "$out.new" 2> /dev/null | sed 's/^[^:]*:\([^:]*\)\.o:/\1 /' > symbols  # member, address, kind, name; some members are empty

echo '.section .tbss,"awT",@nobits; .globl ls_libm_errno; .type ls_libm_errno,@object; .size ls_libm_errno,4; .align 4; ls_libm_errno: .zero 4; .section .note.GNU-stack,"",@progbits' > errno.s
mapfile -t chosen < <(awk '$3 == "i" {print $1}' symbols | uniq)
jumps=(errno)
for member in "${chosen[@]}"; do
  # All names of one choice have its address.
  awk -v member="$member" '
    $3 == "i" && $1 == member {address[$4] = $2}
    $3 == "T" && $1 == member "-fma" && sub(/_fma$/, "", $4) {fused[$4]}
    END {
      for (base in fused) if (base in address) for (name in address) if (address[name] == address[base])
        printf ".globl %s; .type %s,@function; .p2align 4; %s: jmp %s_fma; .size %s,.-%s\n", name, name, name, base, name, name
    }' symbols > "jump-$member.s"
  [ -s "jump-$member.s" ] || continue
  echo '.section .note.GNU-stack,"",@progbits' >> "jump-$member.s"
  jumps+=("jump-$member")
done
[ ${#jumps[@]} -gt 10 ] || { echo "error: $archive has no functions with fused multiply-add" >&2; exit 1; }
for jump in "${jumps[@]}"; do "$cc" -c "$jump.s" -o "$jump.o"; done
"$ar" d "$out.new" "${chosen[@]/%/.o}"
"$ar" rcs "$out.new" "${jumps[@]/%/.o}"
# What is left to the shared libraries has two names in libm.a, of which they give one: __frexp is frexp.
"$nm" "$out.new" 2> /dev/null | awk '$1 == "U" {wanted[$2]} NF == 3 {there[$3]} END {for (name in wanted) if (!(name in there)) print name}' |
  sed -n 's/^__\([a-z0-9]*\)$/--redefine-sym __\1=\1/p' > left
"$objcopy" @left "$out.new"
cmp -s "$out.new" "$out" || mv "$out.new" "$out"  # programs are not linked again without need
