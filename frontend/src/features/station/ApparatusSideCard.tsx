import { Alert, Button, Group, List, Modal, Stack, Text } from "@mantine/core";
import { useDisclosure } from "@mantine/hooks";
import { IconRotate2 } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useAlive, useLive } from "../../lib/live/hooks";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMayOperate } from "../auth/hooks";

type Side = Schemas["Live"]["side"];

/**
 * Shows for which shoulder the apparatus is set up. A person turns the apparatus by hand and confirms this
 * here.
 */
export function ApparatusSideCard({ wanted }: { wanted: Side | undefined }) {
  const operates = useMayOperate();
  const alive = useAlive();
  const mode = useLive("mode");
  const side = useLive("side");
  const [confirming, dialog] = useDisclosure(false);
  const other: Side = side === "right" ? "left" : "right";
  const differs = wanted !== undefined && side !== null && wanted !== side;
  const button = operates && (
    <Button
      size="sm"
      h={44}
      variant={differs ? "filled" : "default"}
      leftSection={<IconRotate2 size={22} />}
      disabled={!alive || mode !== "idle"}
      onClick={dialog.open}
    >
      {t(`station:side.setUp.${other}`)}
    </Button>
  );
  return (
    <div className={alive ? "" : "stale"}>
      {differs ? (
        <Alert variant="outline" color="gray" title={t(`station:side.current.${side}`)}>
          <Group justify="space-between">
            <Text>{t(`station:side.treated.${wanted}`)}</Text>
            {button}
          </Group>
        </Alert>
      ) : (
        <Group justify="space-between" gap="xs">
          <Text size="sm">{side && t(`station:side.current.${side}`)}</Text>
          {button}
        </Group>
      )}
      <SideDialog side={other} opened={confirming} onClose={dialog.close} />
    </div>
  );
}

/** Asks to confirm that the apparatus has been turned for a shoulder. */
function SideDialog(props: { side: Side; opened: boolean; onClose: () => void }) {
  const { side, opened, onClose } = props;
  const setSide = useMutation({ mutationFn: () => api.setSide(side), onSuccess: onClose });
  return (
    <Modal opened={opened} onClose={onClose} title={t(`station:side.dialogTitle.${side}`)} size="lg">
      <Stack>
        <Text>{t("station:side.checksBefore")}</Text>
        <List>
          <List.Item>{t("station:side.armOut")}</List.Item>
          <List.Item>{t(`station:side.turned.${side}`)}</List.Item>
          <List.Item>{t("station:side.armIn")}</List.Item>
        </List>
        <ProblemNote error={setSide.error} />
        <Group>
          <Button size="xl" loading={setSide.isPending} onClick={() => setSide.mutate()}>
            {t(`station:side.confirm.${side}`)}
          </Button>
          <Button size="xl" variant="default" onClick={onClose}>
            {t("station:side.cancel")}
          </Button>
        </Group>
      </Stack>
    </Modal>
  );
}
