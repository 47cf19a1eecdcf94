import { Button, Menu, Text } from "@mantine/core";
import { IconLock, IconLogout, IconUser, IconUserCog } from "@tabler/icons-react";
import { useNavigate } from "@tanstack/react-router";
import { useMe } from "./hooks";
import { access } from "./standing";
import { ROLES } from "./words";

/** Who is signed in here, and what they can do about it. */
export function AccountMenu() {
  const me = useMe();
  const navigate = useNavigate();
  if (!me) return null;
  return (
    <Menu position="bottom-end" zIndex={500}>
      <Menu.Target>
        <Button
          variant="subtle"
          color="dark"
          h={44}
          ml="auto"
          maw={260}
          leftSection={<IconUser size={20} />}
          styles={{ label: { display: "block", overflow: "hidden", textOverflow: "ellipsis" } }}
          aria-label={`Signed in as ${me.name}`}
        >
          {me.name}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>
          <Text size="sm">{me.name}</Text>
          <Text size="sm">{ROLES[me.role].name}</Text>
        </Menu.Label>
        {(me.password || me.openid) && (
          <Menu.Item h={48} leftSection={<IconLock size={20} />} onClick={() => void access.lock()}>
            Lock the screen
          </Menu.Item>
        )}
        <Menu.Item
          h={48}
          leftSection={<IconUserCog size={20} />}
          onClick={() => void navigate({ to: "/account" })}
        >
          My account
        </Menu.Item>
        <Menu.Item h={48} leftSection={<IconLogout size={20} />} onClick={() => void access.signOut()}>
          Sign out
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}
