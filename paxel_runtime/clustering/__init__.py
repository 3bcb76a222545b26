"""Clusters: projector pixels sorted by the colorant they light (paper: section IV-B).

Knows nothing of cameras, captures or files, nor of how a pattern is found in a picture.
"""

from paxel_runtime.clustering.clusters import OUTSIDE, Clusters, cluster
from paxel_runtime.clustering.coverages import cluster_coverages
from paxel_runtime.clustering.diagnostics import Agreement, agreement, cluster_figures, suggest_count
from paxel_runtime.clustering.kmeans import lloyd
from paxel_runtime.clustering.pictures import cluster_colors, label_detail, label_picture

__all__ = [
    "OUTSIDE",
    "Agreement",
    "Clusters",
    "agreement",
    "cluster",
    "cluster_colors",
    "cluster_coverages",
    "cluster_figures",
    "label_detail",
    "label_picture",
    "lloyd",
    "suggest_count",
]
