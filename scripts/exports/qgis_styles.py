"""Opens the layers of a GeoPackage in QGIS, without a window, and tells as JSON how it would draw each.

    python3 qgis_styles.py FILE.gpkg LAYER...      by a Python that has QGIS (Debian's python3-qgis)
"""

import json
import os
import sys

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
from qgis.core import QgsApplication, QgsVectorLayer  # noqa: E402

application = QgsApplication([], False)
application.initQgis()
found = {}
for name in sys.argv[2:]:
    layer = QgsVectorLayer(f"{sys.argv[1]}|layername={name}", name, "ogr")
    _, loaded = layer.loadDefaultStyle()
    renderer = layer.renderer()
    categories = renderer.categories() if hasattr(renderer, "categories") else []
    found[name] = {
        "loaded": loaded, "renderer": renderer.type(),
        "classes": {int(of.value()): [of.label(), of.symbol().symbolLayer(0).properties()["style"]]
                    for of in categories},
    }
print(json.dumps(found))
