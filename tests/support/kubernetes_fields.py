"""JSON schemas of the Kubernetes objects that deploy/kubernetes uses, down to the fields that it uses: a name that is misspelt or
in the wrong place, a missing one, or a wrong type is found. tests/kubernetes/run.sh asks Kubernetes itself."""

TEXT, WHOLE, FLAG = {"type": "string"}, {"type": "integer"}, {"type": "boolean"}
NAME = {"type": "string", "pattern": "^[a-z0-9]([-a-z0-9]*[a-z0-9])?$"}
PORT = {"type": "integer", "minimum": 1, "maximum": 65535}
AMOUNT = {"type": "string", "pattern": r"^[0-9]+(\.[0-9]+)?(m|k|Ki|M|Mi|G|Gi|T|Ti)?$"}
SHARE = {"anyOf": [WHOLE, {"type": "string", "pattern": "^[0-9]+%$"}]}
LABELS = {"type": "object", "additionalProperties": TEXT, "minProperties": 1}


def thing(required=(), **fields):
    """An object of these fields and no others."""
    return {"type": "object", "properties": fields, "required": list(required), "additionalProperties": False}


def many(of):
    return {"type": "array", "items": of}


METADATA = thing(["name"], name=NAME, labels=LABELS, namespace={"const": "lightshaft"})
SELECTOR = thing(["matchLabels"], matchLabels=LABELS)
RESOURCES = thing(["requests", "limits"],
                  requests=thing(["cpu", "memory"], cpu=AMOUNT, memory=AMOUNT, **{"ephemeral-storage": AMOUNT}),
                  limits=thing(["memory"], cpu=AMOUNT, memory=AMOUNT, **{"ephemeral-storage": AMOUNT}))
PROBE = {"oneOf": [{"required": [way]} for way in ("exec", "httpGet", "tcpSocket")],
         **thing(exec=thing(["command"], command=many(TEXT)), httpGet=thing(["path", "port"], path=TEXT, port=NAME, scheme={"enum": ["HTTP", "HTTPS"]}),
                 tcpSocket=thing(["port"], port=NAME), periodSeconds=WHOLE, timeoutSeconds=WHOLE, failureThreshold=WHOLE)}
CONFINED = thing(["readOnlyRootFilesystem", "allowPrivilegeEscalation", "capabilities"], readOnlyRootFilesystem={"const": True},
                 allowPrivilegeEscalation={"const": False}, capabilities={"const": {"drop": ["ALL"]}})
FROM = {"oneOf": [{"required": [way]} for way in ("secretKeyRef", "fieldRef")],
        **thing(secretKeyRef=thing(["name", "key"], name=NAME, key=TEXT), fieldRef=thing(["fieldPath"], fieldPath={"const": "metadata.name"}))}
IMAGE = {"type": "string", "pattern": "^[a-z-]+:[a-z0-9.]+$"}
CONTAINER = thing(["name", "image", "securityContext", "resources"], name=NAME, image=IMAGE, command=many(TEXT), args=many(TEXT),
                  env=many(thing(["name", "valueFrom"], name=TEXT, valueFrom=FROM)),
                  ports=many(thing(["name", "containerPort"], name=NAME, containerPort=PORT)), securityContext=CONFINED,
                  resources=RESOURCES, startupProbe=PROBE, readinessProbe=PROBE, livenessProbe=PROBE,
                  volumeMounts=many(thing(["name", "mountPath"], name=NAME, mountPath=TEXT, readOnly=FLAG)))
VOLUME = {"maxProperties": 2, "minProperties": 2,
          **thing(["name"], name=NAME, secret=thing(["secretName", "defaultMode"], secretName=NAME, defaultMode={"enum": [0o440, 0o400]},
                                                    items=many(thing(["key", "path"], key=TEXT, path=TEXT))),
                  persistentVolumeClaim=thing(["claimName"], claimName=NAME),
                  emptyDir=thing(["sizeLimit"], sizeLimit=AMOUNT, medium={"const": "Memory"}))}
POD_SECURITY = thing(["runAsNonRoot", "runAsUser", "fsGroup", "seccompProfile"], runAsNonRoot={"const": True}, runAsUser={"const": 10001},
                     runAsGroup={"const": 10001}, fsGroup={"const": 10001}, seccompProfile={"const": {"type": "RuntimeDefault"}})
EXPRESSION = thing(["key", "operator"], key=TEXT, operator={"enum": ["In", "NotIn", "Exists", "DoesNotExist"]}, values=many(TEXT))
POD = thing(["containers", "securityContext", "automountServiceAccountToken"], automountServiceAccountToken={"const": False},
            terminationGracePeriodSeconds=WHOLE, priorityClassName=NAME, securityContext=POD_SECURITY,
            tolerations=many(thing(["key", "operator", "effect"], key=TEXT, operator={"enum": ["Exists", "Equal"]},
                                   effect={"enum": ["NoSchedule", "PreferNoSchedule", "NoExecute"]})),
            affinity=thing(nodeAffinity=thing(preferredDuringSchedulingIgnoredDuringExecution=many(
                thing(["weight", "preference"], weight=WHOLE, preference=thing(matchExpressions=many(EXPRESSION)))))),
            initContainers=many(CONTAINER), containers=many(CONTAINER), volumes=many(VOLUME))
TEMPLATE = thing(["metadata", "spec"], metadata=thing(["labels"], labels=LABELS), spec=POD)
CLAIM = thing(["metadata", "spec"], metadata=METADATA, spec=thing(["accessModes", "resources"], accessModes={"const": ["ReadWriteOnce"]},
                                                                  resources=thing(["requests"], requests=thing(["storage"], storage=AMOUNT))))
PEER_PORTS = many(thing(["port"], protocol={"enum": ["TCP", "UDP"]}, port=PORT))
PEERS = many(thing(["podSelector"], podSelector=SELECTOR))
SCALED = {"const": {"apiVersion": "apps/v1", "kind": "Deployment", "name": "worker"}}
POLICIES = many(thing(["type", "value", "periodSeconds"], type={"enum": ["Percent", "Pods"]}, value=WHOLE, periodSeconds=WHOLE))

SPECS = {
    ("v1", "Service"): thing(["selector", "ports"], clusterIP={"const": "None"}, publishNotReadyAddresses=FLAG, selector=LABELS,
                             ports=many(thing(["name", "port", "targetPort"], name=NAME, port=PORT, targetPort=NAME))),
    ("apps/v1", "StatefulSet"): thing(["serviceName", "replicas", "selector", "template", "volumeClaimTemplates"], serviceName=NAME,
                                      replicas={"enum": [1, 2]}, selector=SELECTOR, template=TEMPLATE, volumeClaimTemplates=many(CLAIM)),
    ("apps/v1", "Deployment"): thing(["selector", "template"], replicas={"const": 0}, selector=SELECTOR, template=TEMPLATE, strategy=thing(
        ["type"], type={"const": "RollingUpdate"}, rollingUpdate=thing(maxUnavailable=SHARE, maxSurge=SHARE))),
    ("v1", "PersistentVolumeClaim"): thing(["accessModes", "resources"], accessModes={"const": ["ReadWriteMany"]},
                                           resources=thing(["requests"], requests=thing(["storage"], storage=AMOUNT))),
    ("networking.k8s.io/v1", "NetworkPolicy"): thing(
        ["podSelector", "policyTypes"], podSelector=SELECTOR, policyTypes=many({"enum": ["Ingress", "Egress"]}),
        ingress=many({"anyOf": [thing(["ports"], **{"from": PEERS, "ports": PEER_PORTS})]}),
        egress=many(thing(["ports"], to=PEERS, ports=PEER_PORTS))),
    ("policy/v1", "PodDisruptionBudget"): {"maxProperties": 2, "minProperties": 2,
                                           **thing(["selector"], minAvailable=SHARE, maxUnavailable=SHARE, selector=SELECTOR)},
    ("autoscaling/v2", "HorizontalPodAutoscaler"): thing(
        ["scaleTargetRef", "minReplicas", "maxReplicas", "metrics"], scaleTargetRef=SCALED, minReplicas={"minimum": 1, **WHOLE}, maxReplicas=WHOLE,
        metrics=many(thing(["type", "external"], type={"const": "External"}, external=thing(
            ["metric", "target"], metric=thing(["name"], name=TEXT), target=thing(["type", "averageValue"], type={"const": "AverageValue"}, averageValue=AMOUNT)))),
        behavior=thing(scaleUp=thing(policies=POLICIES, selectPolicy={"enum": ["Max", "Min"]}, stabilizationWindowSeconds=WHOLE),
                       scaleDown=thing(policies=POLICIES, selectPolicy={"enum": ["Max", "Min"]}, stabilizationWindowSeconds=WHOLE))),
    ("keda.sh/v1alpha1", "ScaledObject"): thing(
        ["scaleTargetRef", "maxReplicaCount", "triggers"], scaleTargetRef=SCALED, minReplicaCount=WHOLE, maxReplicaCount=WHOLE,
        pollingInterval=WHOLE, cooldownPeriod=WHOLE,
        triggers=many(thing(["type", "metadata"], type={"const": "prometheus"}, metricType={"enum": ["AverageValue", "Value"]},
                            metadata=thing(["serverAddress", "query", "threshold"], serverAddress=TEXT, query=TEXT, threshold=TEXT)))),
}
WHOLES = {  # objects without a spec
    ("v1", "Secret"): thing(["apiVersion", "kind", "metadata", "type", "stringData"], apiVersion=TEXT, kind=TEXT, metadata=METADATA,
                            type={"const": "Opaque"}, stringData={"type": "object", "additionalProperties": TEXT}),
    ("scheduling.k8s.io/v1", "PriorityClass"): thing(["apiVersion", "kind", "metadata", "value"], apiVersion=TEXT, kind=TEXT, metadata=METADATA, value=WHOLE,
                                                     preemptionPolicy={"enum": ["Never", "PreemptLowerPriority"]}, globalDefault=FLAG, description=TEXT),
}


def schema_of(manifest):
    kind = (manifest.get("apiVersion"), manifest.get("kind"))
    if kind in WHOLES:
        return WHOLES[kind]
    return thing(["apiVersion", "kind", "metadata", "spec"], apiVersion={"const": kind[0]}, kind={"const": kind[1]}, metadata=METADATA, spec=SPECS[kind])
