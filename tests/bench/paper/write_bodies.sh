#!/bin/sh
# The bodies of the paper's scenes with as many linear tets as the paper's: write_bodies.sh BODIES OUT_FOLDER. Ball 9k, ring
# 60k, starfish 6k, jellyfish 37k (bell and four arms). Everything else as BODIES/NAME.body.toml says. A file that would not
# change is left alone, so that make sees what is new.
from=$(cd "$1" && pwd) || exit 2
out=$2
mkdir -p "$out" || exit 5
for body in sphere:9_000 torus:60_000 starfish:6_000 starfish_firm:6_000 jellyfish_bell:21_000 jellyfish_arm1:4_000 \
  jellyfish_arm2:4_000 jellyfish_arm3:4_000 jellyfish_arm4:4_000 jellyfish_skin:; do
  name=${body%:*} tets=${body#*:}
  sed -e "s|^mesh = \"|&$from/|" -e "s|^tet = .*|tet = { mesher = \"cgal\", target = $tets, order = 1 }|" \
    "$from/$name.body.toml" >"$out/$name.part" || exit $?
  if cmp -s "$out/$name.part" "$out/$name.body.toml"; then rm "$out/$name.part"
  else mv "$out/$name.part" "$out/$name.body.toml"; fi
done
