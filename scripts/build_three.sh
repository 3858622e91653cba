#!/bin/sh
# Makes protocol/flight_log/page/three.min.js: the parts of three.js that the pages draw with, in one script, with its
# licence at the head. Needs npm. Run it again after a change of the list below or of the versions.
set -eu
cd "$(dirname "$0")/.."
page=$PWD/protocol/flight_log/page
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cd "$folder"
npm install --silent --no-save three@0.187.0 esbuild@0.28.2
cat > parts.js <<'PARTS'
export {
  CanvasTexture, CircleGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, EdgesGeometry,
  BufferGeometry, ExtrudeGeometry, GridHelper, Group, HemisphereLight, InstancedMesh, Line, LineBasicMaterial,
  LineSegments, Mesh, MeshLambertMaterial, Object3D, PerspectiveCamera, Quaternion, Scene, Shape, SphereGeometry,
  Sprite, SpriteMaterial, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { LineMaterial } from "three/examples/jsm/lines/LineMaterial.js";
export { LineSegments2 } from "three/examples/jsm/lines/LineSegments2.js";
export { LineSegmentsGeometry } from "three/examples/jsm/lines/LineSegmentsGeometry.js";
PARTS
{
  echo "/*! three.js 0.187.0, https://threejs.org"
  cat node_modules/three/LICENSE
  echo "*/"
  node_modules/.bin/esbuild parts.js --bundle --minify --format=iife --global-name=THREE --legal-comments=none
} > "$page/three.min.js"
